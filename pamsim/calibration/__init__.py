"""Fit parameters of a rig to recordings and tables of angles at rest."""
