"""Every hysteresis operator: the cards, each of which stands in the file of its operator."""

from __future__ import annotations

from pamsim.core.catalog import Catalog
from pamsim.physics.hysteresis import (
    arctangent,
    bouc_wen,
    fractional_maxwell,
    maxwell_slip,
    prandtl_ishlinskii,
    preisach,
)
from pamsim.physics.hysteresis.group import Operator

# The place of a card is the code that saved models hold: a new one comes last.
OPERATORS = Catalog(
    Operator,
    (
        bouc_wen.CARD,
        maxwell_slip.CARD,
        prandtl_ishlinskii.CARD,
        preisach.PREISACH,
        preisach.PLEATED_FACTOR,
        arctangent.CARD,
        fractional_maxwell.CARD,
    ),
    slot="hysteresis.law",
    first=1,
)
"""Every operator by its name."""
