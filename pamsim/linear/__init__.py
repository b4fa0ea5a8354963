"""Transfer functions, ARX and output-error fits."""
