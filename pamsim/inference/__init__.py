"""Bounded least squares, intervals, noise models and profile likelihood; no engine."""
