"""Controllers of the antagonistic arm: pure functions of an observation and a memory."""
