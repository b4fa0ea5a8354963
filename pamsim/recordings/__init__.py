"""Experiments, logs, tables and files: what was commanded and measured, and how it is stored."""
