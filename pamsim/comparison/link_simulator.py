"""What a fit of effects needs of a simulator, whatever the data: trials, rows at rest, loops.

Both give residuals of links as one vector, simulated minus measured, in blocks of rows, and group
their units: trials that repeat each other, or one row.
"""

from __future__ import annotations

from typing import TypeAlias

from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.comparison.rest_simulator import RestSimulator

LinkSimulator: TypeAlias = ChainSimulator | RestSimulator
"""Of trials, or of rows at rest; see `ChainSimulator` for attributes and methods."""
