"""Nguyen et al. 2024: the fractional Maxwell model."""
