"""Figures, pages and CSV files from finished results; nothing physical is computed here."""
