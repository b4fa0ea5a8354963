"""Where simulation and data disagree, which effect is missing, and how sure that is."""
