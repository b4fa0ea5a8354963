"""MATLAB models for pneumatic artificial muscles: static force models of a DMSP-20-200N."""
