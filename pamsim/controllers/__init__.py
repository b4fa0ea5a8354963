"""Controllers of the antagonistic arm: pure functions of what is seen and of a memory passed in."""
