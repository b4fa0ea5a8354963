"""Every force law: the cards, each of which stands in the file of its law."""

from __future__ import annotations

from pamsim.core.catalog import Catalog
from pamsim.physics.force_laws import effective_area, exponential, mckibben, mooney_rivlin, pleated
from pamsim.physics.force_laws.force_law import ForceLaw

# The place of a card is the code that saved models hold: a new one comes last.
FORCE_LAWS = Catalog(
    ForceLaw,
    (
        mckibben.IDEAL,
        exponential.SIX_PARAMETER,
        mckibben.CORRECTED,
        exponential.SINGLE_PRESSURE,
        exponential.INVERTIBLE,
        mckibben.RESTORING,
        pleated.FITTED,
        pleated.EXACT,
        mooney_rivlin.CARD,
        effective_area.CARD,
    ),
    slot="force.law",
)
"""Every force law by its name."""
