"""Transfer functions, ARX and output-error fits: the only importer of python-control."""
