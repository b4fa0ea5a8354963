"""Physical effects that a rig's model may be missing: a table of cards per file, by link."""
