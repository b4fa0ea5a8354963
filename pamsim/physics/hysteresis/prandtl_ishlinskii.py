"""Prandtl-Ishlinskii operator: a weighted sum of plays, with its exact inverse operator.

P[v] = w_0 v + sum of w_k play(v; r_k). With w_0 > 0 and weights that keep every partial sum
positive, the inverse is of the same kind and known in closed form (Krejci and Kuhnen 2001; Kuhnen
2003): with S_k = w_0 + w_1 + ... + w_k,

    w_0' = 1/w_0,  w_k' = -w_k / (S_k S_(k-1)),  r_k' = sum over j < k of S_j (r_(j+1) - r_j).

P lags its input, so its inverse leads. In the muscle the contraction lags the force; the kernel
therefore takes the force from the contraction by the inverse operator.
"""

from __future__ import annotations

import itertools
import operator
from collections.abc import Sequence
from dataclasses import dataclass

from pamsim.core.errors import InputError
from pamsim.core.parameters import quantity
from pamsim.physics.hysteresis.group import Hysteresis, MutableRow, Operator, Row
from pamsim.physics.hysteresis.maxwell_slip import play


class PrandtlIshlinskii(Hysteresis, law="prandtl_ishlinskii", count_field="elements"):
    """Thresholds (k - 1/2)/n of the largest output, weights in the ratio 1 : decay : decay^2 ..."""

    elements: float = quantity("[1, 64]", "number n of plays")
    span: float = quantity("(0, 0.5]", "contraction at which the output is 1")
    decay: float = quantity("[0.1, 10]", "ratio of the weights of neighbouring plays", 1.0)
    linear_share: float = quantity(
        "(0, 1]",
        "share w_0 of the play-free part in the sum of the weights; 1 leaves no hysteresis",
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
        """Check that the operator can be inverted.

        Raises:
            InputError: if thresholds do not increase from above 0 or a partial sum is not positive.
        """
        if len(self.weights) != len(self.thresholds) or min(self._steps(), default=1.0) <= 0.0:
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
        risen = itertools.accumulate(map(operator.mul, sums, self._steps()))
        weights = (-w / (low * s) for w, low, s in zip(self.weights, sums, sums[1:], strict=False))
        return PlaySum(linear=1.0 / self.linear, thresholds=tuple(risen), weights=tuple(weights))

    def _steps(self) -> list[float]:
        return [b - a for a, b in itertools.pairwise((0.0, *self.thresholds))]

    def _partial_sums(self) -> list[float]:
        """S_0 ... S_n: gradients of the pieces of the initial curve."""
        return list(itertools.accumulate((self.linear, *self.weights)))


def scale_and_weight(h: PrandtlIshlinskii) -> tuple[float, float]:
    """Factor [-] from contraction to the output of P, and weight w_1 [-] of its first play.

    The factor is P's initial curve at 1, w_0 + sum of w_k (1 - r_k), over ``span``, so that a
    contraction of ``span`` gives w = 1.
    """
    weight, weights, reached = 1.0, 0.0, 0.0
    for k in range(int(h.elements)):
        weights += weight
        reached += weight * (1.0 - (k + 0.5) / int(h.elements))
        weight *= h.decay
    first = (1.0 - h.linear_share) / weights
    return (h.linear_share + first * reached) / h.span, first


def output_and_energy(h: PrandtlIshlinskii, z: Row, x: float) -> tuple[float, float]:
    """Output w of the inverse operator (Kuhnen 2003), a pure number, and its energy [contraction].

    The inverse is a spring of unit stiffness and stops with positive weights, each of which holds
    half its stiffness times its stretch squared. z are the outputs of its plays.
    """
    scale, weight = scale_and_weight(h)
    y = x * scale
    output, energy = y, y * y
    slope = h.linear_share
    threshold = 0.5 * slope / h.elements
    for k in range(int(h.elements)):
        stiffness = weight / (slope * (slope + weight))
        stretch = y - play(y, z[k], threshold)
        output += stiffness * stretch
        energy += stiffness * stretch * stretch
        slope += weight
        threshold += slope / h.elements
        weight *= h.decay
    return output, 0.5 * energy / scale


def prandtl_ishlinskii_output(h: PrandtlIshlinskii, z: Row, x: float) -> float:
    """Output w, a pure number, see `output_and_energy`."""
    return output_and_energy(h, z, x)[0]


def prandtl_ishlinskii_energy(h: PrandtlIshlinskii, z: Row, x: float) -> float:
    """Energy that the operator holds [contraction], see `output_and_energy`."""
    return output_and_energy(h, z, x)[1]


def prandtl_ishlinskii_rates(
    h: PrandtlIshlinskii, z: Row, dz: MutableRow, x: float, x_rate: float, timestep: float
) -> None:
    """Write the rates [1/s] that bring every play to where input x leaves it."""
    scale, weight = scale_and_weight(h)
    slope = h.linear_share
    threshold = 0.5 * slope / h.elements
    for k in range(int(h.elements)):
        dz[k] = (play(x * scale, z[k], threshold) - z[k]) / timestep
        slope += weight
        threshold += slope / h.elements
        weight *= h.decay


CARD = Operator(
    name="prandtl_ishlinskii",
    title="Prandtl-Ishlinskii",
    equation="w = inverse of P[w] = w_0 w + sum w_k play(w; r_k) at the scaled contraction",
    source="Krejci and Kuhnen 2001; Kuhnen 2003",
    group=PrandtlIshlinskii,
    output=prandtl_ishlinskii_output,
    energy=prandtl_ishlinskii_energy,
    rates=prandtl_ishlinskii_rates,
    rate_independent=True,
    odd=True,
    notes="Does not saturate: it contains a spring, and beyond span w grows above 1.",
)
