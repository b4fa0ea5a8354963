"""Physical effects that a rig's model may be missing: a file per layer, named as in diagnoses."""
