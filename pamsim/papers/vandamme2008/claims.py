"""Van Damme 2008: Preisach hysteresis of pleated muscles, all its numbers and claims."""

from __future__ import annotations

from pamsim.papers.claim import Claim
from pamsim.papers.vandamme2008 import delta as paper_d_delta
from pamsim.papers.vandamme2008 import factor as paper_d_factor
from pamsim.papers.vandamme2008 import preisach as paper_d_preisach
from pamsim.papers.vandamme2008 import shape as paper_d_shape


def claims() -> list[Claim]:
    """Recompute Van Damme 2008; fitting the noisy loops takes most of the time."""
    return [
        *paper_d_shape.claims(),
        *paper_d_preisach.claims(),
        *paper_d_factor.claims(),
        *paper_d_delta.claims(),
    ]
