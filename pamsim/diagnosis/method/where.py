"""Over which quantity a model misses the rows of a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.verdict_thresholds import SIGNIFICANCE
from pamsim.inference.permutation import exchange_p_value

_MOST_ROW_BINS = 4
_FEWEST_ROWS = 3  # in a bin
_EXCHANGES = 4_999


@dataclass(frozen=True, kw_only=True)
class ResidualMap:
    """A channel's mean residual over bins of one quantity.

    Attributes:
        channel: such as ``angle``.
        quantity: such as ``common_pressure``.
        edges: of the bins [SI], (b + 1,): the lowest row in each bin, and the highest of all.
        mean: (b,) of the residual in each bin, measured minus simulated [SI].
        p_value: that the residual does not depend on the quantity: one for the whole map, by
            exchanging rows.
        worst: number of the bin that is off most; of bins as far off, that of the largest mean.
        rows: names of the rows in each bin.
        rms: (b,) root mean square of the residual of rows [SI].
    """

    channel: str
    quantity: str
    edges: FloatArray
    mean: FloatArray
    p_value: float
    worst: int
    rows: tuple[tuple[str, ...], ...] = ()
    rms: FloatArray | None = None

    @property
    def region(self) -> tuple[float, float]:
        """Ends of the bin that is off most [SI]."""
        return float(self.edges[self.worst]), float(self.edges[self.worst + 1])


def row_maps(
    misfit: FloatArray,
    quantities: Mapping[str, FloatArray],
    names: tuple[str, ...],
    *,
    channel: str,
    seed: int = 0,
) -> tuple[ResidualMap, ...]:
    """Map the misfit of a table's rows over every quantity, the most significant map first.

    Args:
        misfit: (n,) measured minus simulated [SI], with the sign in which it means something.
        quantities: name -> its values, (n,) [SI]; those that do not vary are skipped.
        names: of the rows.
        channel: what the table measures.
        seed: random seed of the exchanges.
    """
    maps: list[ResidualMap] = []
    for quantity, values in quantities.items():
        bins = _row_bins(values)
        if bins.max(initial=0) > 0:
            maps.append(_row_map(channel, quantity, values, misfit, bins, names, seed))
    return tuple(sorted(maps, key=lambda m: (m.p_value, -float(np.max(np.abs(m.mean))))))


def systematic(maps: Sequence[ResidualMap]) -> bool:
    """Whether a residual depends on one of its quantities, by the Bonferroni-corrected p-value.

    Without repeats this is the only test of a remainder that a table of rows allows.
    """
    return any(m.p_value * len(maps) < SIGNIFICANCE for m in maps)


def _row_bins(values: FloatArray) -> NDArray[np.intp]:
    """Number of each row's bin: about equal counts, equal values together."""
    kinds, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    wanted = max(min(_MOST_ROW_BINS, values.size // _FEWEST_ROWS), 1)
    number, inside = np.zeros(kinds.size, dtype=np.intp), 0
    for k in range(1, kinds.size):
        inside += int(counts[k - 1])
        left = int(counts[k:].sum())
        full = inside >= max(values.size / wanted - 0.5, _FEWEST_ROWS)
        number[k] = number[k - 1] + (1 if full and left >= _FEWEST_ROWS else 0)
        inside = 0 if number[k] > number[k - 1] else inside
    return number[place]


def _row_map(
    channel: str,
    quantity: str,
    values: FloatArray,
    misfit: FloatArray,
    bins: NDArray[np.intp],
    names: tuple[str, ...],
    seed: int,
) -> ResidualMap:
    """Judge a map by its largest standardised bin, against the same with rows exchanged."""
    count = int(bins.max()) + 1
    order = np.lexsort((misfit, values))  # not the order of the table, which means nothing
    member = np.zeros((misfit.size, count))
    member[np.arange(misfit.size), bins[order]] = 1.0
    many = member.sum(axis=0)
    off = (misfit - misfit.mean())[order]

    def standardised(rows: FloatArray) -> FloatArray:
        # Divided by the root of the count, a bin of a few rows needs a larger mean.
        return np.abs(rows @ member) / np.sqrt(many * (1.0 - many / misfit.size))

    lows = [float(values[bins == b].min()) for b in range(count)]
    mean = np.array([misfit[bins == b].mean() for b in range(count)])
    # Of two bins, the one is always as far off as the other: rounding must not choose.
    sizes = standardised(off[np.newaxis])[0]
    worst = np.where(sizes > (1.0 - 1e-9) * sizes.max(), np.abs(mean), -1.0).argmax()
    return ResidualMap(
        channel=channel,
        quantity=quantity,
        edges=np.array([*lows, float(values.max())]),
        mean=mean,
        p_value=exchange_p_value(
            lambda rows: standardised(rows).max(axis=1),
            off,
            _EXCHANGES,
            np.random.default_rng(seed),
        ),
        worst=int(worst),
        rows=tuple(
            tuple(name for name, b in zip(names, bins, strict=True) if b == number)
            for number in range(count)
        ),
        rms=np.array([np.sqrt(np.mean(misfit[bins == b] ** 2)) for b in range(count)]),
    )
