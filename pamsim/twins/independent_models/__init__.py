"""Hidden effects by formulas that the library of effects does not share, and effects outside it."""
