"""Physical effects that a rig's model may be missing; the cards lie in ``pamsim/data/effects/``."""
