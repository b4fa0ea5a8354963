"""Operators with memory, their state explicit."""
