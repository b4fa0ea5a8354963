"""Every threshold on which the verdict of a table at rest or a loop rests."""

from __future__ import annotations

SIGNIFICANCE = 0.05
"""p-value, corrected for all effects that were tried, below which an effect may be claimed."""

ADEQUATE = 0.97
"""Share of what the base model misses that a named effect must explain, where a significant
remainder is left. The rest is what its formula may be off by; of two effects, each may be."""

MOST = 0.5
"""Share of what the base model misses that a named effect must explain in any case."""

TIE_ERRORS = 2.0
"""Standard errors of a loss difference within which another model predicts as well."""

TIE_SHARE = 0.5
"""Share of the best model's gain that a rival must reach."""

FAR_NUISANCE = 0.25
"""Share of the rig's own value by which a nuisance parameter, known to a few per cent, may be
refitted without the verdict saying so: beyond, it may stand in for what is missing."""

FEWEST_ROWS = 10
"""Rows of a table below which no arrangement of signs is improbable enough to name one of twenty
effects."""

FEWEST_LEVELS = 5
"""Levels of a loop that must be read on both branches."""
