"""Hidden effects whose formulas the library of effects does not share, and effects outside it."""
