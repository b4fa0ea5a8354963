"""Curves of control values that are spread evenly over what they run over."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.diagnosis.by_link.learned_curve import POINTS, Curve, Kind
from pamsim.diagnosis.by_link.sizes import SizeErrors
from pamsim.physics.spline import shares


@dataclass(frozen=True, kw_only=True)
class EvenPlace:
    """A place whose curves all run from one end to the other in even steps.

    Attributes:
        acts_at: as of its curves.
        ends_at: beginning of the names of the parameters of the ends.
        low: end of what was visited.
        high: other end.
        fields: kind of curve -> beginning of the names of its control values.
        count: control values of each curve.
    """

    acts_at: str
    ends_at: str
    low: float
    high: float
    fields: Mapping[Kind, str]
    count: int

    def ends(self, kinds: Collection[Kind]) -> dict[str, float]:
        """Parameters of the ends that its curves share."""
        if not set(kinds) & self.fields.keys():
            return {}
        return {f"{self.ends_at}low": self.low, f"{self.ends_at}high": self.high}

    def controls(self, kind: Kind) -> Sequence[str]:
        """Names of the control values of a curve."""
        field = self.fields.get(kind)
        return [f"{field}{k}" for k in range(1, self.count + 1)] if field else ()

    def curves(
        self, kinds: Sequence[Kind], values: Mapping[str, float], errors: SizeErrors
    ) -> Iterator[Curve]:
        """The learned curves as sums of their control values."""
        at = np.linspace(self.low, self.high, POINTS)
        of_each = shares(at, self.low, self.high, self.count)
        for kind in (one for one in kinds if one in self.fields):
            names = self.controls(kind)
            yield Curve(
                kind=kind,
                acts_at=self.acts_at,
                at=at,
                value=of_each @ [values[name] for name in names],
                reach=errors.reach(dict(zip(names, of_each.T, strict=True))),
            )
