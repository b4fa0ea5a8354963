"""Prandtl-Ishlinskii operator: a weighted sum of plays, with its exact inverse operator.

P[v] = w_0 v + sum of w_k play(v; r_k). With w_0 > 0 and weights that keep every partial sum
positive, the inverse is of the same kind and known in closed form (Krejci and Kuhnen 2001; Kuhnen
2003): with S_k = w_0 + w_1 + ... + w_k,

    w_0' = 1/w_0,  w_k' = -w_k / (S_k S_(k-1)),  r_k' = sum over j < k of S_j (r_(j+1) - r_j).

P lags its input, so its inverse leads. In the muscle the contraction lags the force; the kernel
therefore takes the force from the contraction by the inverse operator.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from pamsim.core.errors import InputError
from pamsim.core.parameters import parameter
from pamsim.physics.hysteresis.group import Hysteresis, MutableRow, Row
from pamsim.physics.hysteresis.play import play


@dataclass(frozen=True, kw_only=True)
class PrandtlIshlinskii(Hysteresis):
    """Thresholds (k - 1/2)/n of the largest output, weights in the ratio 1 : decay : decay^2 ..."""

    law: ClassVar[str] = "prandtl_ishlinskii"
    count_field: ClassVar[str] = "elements"
    elements: float = parameter(unit="1", low=1.0, high=64.0, doc="number n of plays")
    span: float = parameter(
        unit="1", low=0.0, high=0.5, low_open=True, doc="contraction at which the output is 1"
    )
    decay: float = parameter(
        unit="1", low=0.1, high=10.0, doc="ratio of the weights of neighbouring plays", default=1.0
    )
    linear_share: float = parameter(
        unit="1",
        low=0.0,
        high=1.0,
        low_open=True,
        doc="share w_0 of the play-free part in the sum of the weights; 1 leaves no hysteresis",
    )

    def compliance(self) -> PlaySum:
        """The operator P from output w to scaled contraction, whose inverse the kernel runs."""
        count = int(self.elements)
        raw = [self.decay**k for k in range(count)]
        scale = (1.0 - self.linear_share) / sum(raw)
        return PlaySum(
            linear=self.linear_share,
            thresholds=tuple((k + 0.5) / count for k in range(count)),
            weights=tuple(scale * weight for weight in raw),
        )


@dataclass(frozen=True, kw_only=True)
class PlaySum:
    """A Prandtl-Ishlinskii operator for analysis; its memory is passed in and handed back.

    Attributes:
        linear: w_0.
        thresholds: r_k, positive and increasing, in the unit of the input.
        weights: w_k.
    """

    linear: float
    thresholds: tuple[float, ...]
    weights: tuple[float, ...]

    def __post_init__(self) -> None:
        """Check the thresholds, and that the operator can be inverted.

        Raises:
            InputError: if thresholds do not increase from above 0 or a partial sum is not positive.
        """
        lower = (0.0, *self.thresholds)[:-1]
        if len(self.weights) != len(self.thresholds) or any(
            r <= before for r, before in zip(self.thresholds, lower, strict=True)
        ):
            raise InputError("thresholds must increase from above 0, with one weight for each")
        if min(self._partial_sums()) <= 0.0:
            raise InputError("every partial sum of the weights must be positive")

    def virgin(self) -> tuple[float, ...]:
        """Memory of an operator before any input."""
        return (0.0,) * len(self.weights)

    def step(self, memory: Sequence[float], x: float) -> tuple[tuple[float, ...], float]:
        """New memory and output at input x."""
        held = tuple(play(x, z, r) for z, r in zip(memory, self.thresholds, strict=True))
        return held, self.linear * x + sum(w * z for w, z in zip(self.weights, held, strict=True))

    def inverse(self) -> PlaySum:
        """The operator that undoes this one exactly (Kuhnen 2003)."""
        sums = self._partial_sums()
        threshold, before = 0.0, 0.0
        thresholds: list[float] = []
        for slope, r in zip(sums, self.thresholds, strict=False):
            threshold += slope * (r - before)
            before = r
            thresholds.append(threshold)
        weights = tuple(-w / (sums[k] * sums[k + 1]) for k, w in enumerate(self.weights))
        return PlaySum(linear=1.0 / self.linear, thresholds=tuple(thresholds), weights=weights)

    def _partial_sums(self) -> list[float]:
        """The partial sums S_0 ... S_n: gradients of the pieces of the initial curve."""
        sums = [self.linear]
        for weight in self.weights:
            sums.append(sums[-1] + weight)
        return sums


def input_scale(h: PrandtlIshlinskii) -> float:
    """Factor [-] from contraction to the output of P, so that contraction ``span`` gives w = 1.

    It is P's initial curve at 1, w_0 + sum of w_k (1 - r_k), over ``span``.
    """
    elements = int(h.elements)
    decay = h.decay
    linear = h.linear_share
    weight = 1.0
    weights = 0.0
    reached = 0.0
    for k in range(elements):
        weights += weight
        reached += weight * (1.0 - (k + 0.5) / elements)
        weight *= decay
    return (linear + (1.0 - linear) * reached / weights) / h.span


def first_weight(h: PrandtlIshlinskii) -> float:
    """Weight w_1 [-] of the first play; the others follow by the factor ``decay``."""
    weight = 1.0
    weights = 0.0
    for _ in range(int(h.elements)):
        weights += weight
        weight *= h.decay
    return (1.0 - h.linear_share) / weights


def prandtl_ishlinskii_output(h: PrandtlIshlinskii, z: Row, x: float) -> float:
    """Inverse Prandtl-Ishlinskii operator of the contraction (Kuhnen 2003).

    Args:
        h: parameters.
        z: outputs of the inverse's plays [scaled contraction].
        x: contraction [-].

    Returns:
        w, 1 where a virgin muscle has contracted by ``span``; outside it grows on.
    """
    elements = int(h.elements)
    y = x * input_scale(h)
    weight = first_weight(h)
    slope = h.linear_share
    result = y / slope
    threshold = 0.0
    before = 0.0
    for k in range(elements):
        limit = (k + 0.5) / elements
        threshold += slope * (limit - before)
        before = limit
        result -= weight / (slope * (slope + weight)) * play(y, z[k], threshold)
        slope += weight
        weight *= h.decay
    return result


def prandtl_ishlinskii_rates(
    h: PrandtlIshlinskii, z: Row, dz: MutableRow, x: float, x_rate: float, timestep: float
) -> None:
    """Write the rates that bring every play to where input x leaves it.

    Args:
        h: parameters.
        z: outputs of the inverse's plays [scaled contraction].
        dz: (elements,) written [1/s].
        x: contraction [-].
        x_rate: not used; the operator does not know time.
        timestep: of the explicit Euler step [s].
    """
    elements = int(h.elements)
    y = x * input_scale(h)
    weight = first_weight(h)
    slope = h.linear_share
    threshold = 0.0
    before = 0.0
    for k in range(elements):
        limit = (k + 0.5) / elements
        threshold += slope * (limit - before)
        before = limit
        dz[k] = (play(y, z[k], threshold) - z[k]) / timestep
        slope += weight
        weight *= h.decay


def prandtl_ishlinskii_energy(h: PrandtlIshlinskii, z: Row, x: float) -> float:
    """Energy that the operator holds [contraction]; arguments as `prandtl_ishlinskii_output`.

    With plays y - stop, the inverse is a spring of unit stiffness and stops with positive weights:
    each holds half its stiffness times its stretch squared.
    """
    elements = int(h.elements)
    scale = input_scale(h)
    y = x * scale
    weight = first_weight(h)
    slope = h.linear_share
    total = y * y
    threshold = 0.0
    before = 0.0
    for k in range(elements):
        limit = (k + 0.5) / elements
        threshold += slope * (limit - before)
        before = limit
        stretch = y - play(y, z[k], threshold)
        total += weight / (slope * (slope + weight)) * stretch * stretch
        slope += weight
        weight *= h.decay
    return 0.5 * total / scale
