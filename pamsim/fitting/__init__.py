"""Fit force laws and hysteresis operators to measured tables, and rank them."""
