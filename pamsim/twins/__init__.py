"""Synthetic recordings of a rig in which effects are hidden."""
