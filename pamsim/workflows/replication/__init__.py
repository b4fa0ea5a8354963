"""Every printed number of the source papers, recomputed from what is printed, with a verdict."""
