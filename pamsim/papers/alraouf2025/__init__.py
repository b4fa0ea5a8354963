"""Alraouf et al. 2025: arctangent pressure-length hysteresis."""
