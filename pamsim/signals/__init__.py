"""Measurement chains and figures read off signals."""
