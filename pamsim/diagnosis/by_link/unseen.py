"""What a judgement needs of data that no fit has seen: held-out trials, or rows left out."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Protocol

from pamsim.comparison.links import Link
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.link_model import LinkModel
from pamsim.diagnosis.by_link.remainder import Remainder


@dataclass(frozen=True, kw_only=True)
class Difference:
    """By how much one model predicts unseen data better than another.

    Attributes:
        gain: mean difference of their losses [noise variance].
        p_value: of none.
        by_unit: differences of which the gain is the mean, (u,).
    """

    gain: float
    p_value: float
    by_unit: FloatArray


class Unseen(Protocol):
    """Data that no fit has seen."""

    def beyond_noise(self, model: LinkModel) -> Mapping[Link, float]:
        """What a model leaves in every link beyond the noise, a mean square [noise variance]."""
        ...

    def better(self, model: LinkModel, rest: LinkModel, links: Collection[Link]) -> Difference:
        """How much better a model predicts some links than the same without one effect."""
        ...

    def worse(
        self, rival: LinkModel, model: LinkModel, rest: LinkModel, links: Collection[Link]
    ) -> Difference:
        """How much worse a rival predicts some links; ``rest`` is without either effect."""
        ...

    def remainders(self, model: LinkModel) -> Mapping[Link, Remainder]:
        """What a model leaves in every link that is no noise."""
        ...
