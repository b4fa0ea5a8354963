"""Physical effects that a rig's model may lack: one per file, named as in diagnoses."""
