"""Gymnasium environments of the antagonistic arm."""
