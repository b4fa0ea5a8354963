"""Where a model misses rows of a table: its residual over the quantities of the rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_MOST_BINS = 4
_FEWEST = 3  # rows in a bin
_EXCHANGES = 4_999
_BLOCK = 500


@dataclass(frozen=True, kw_only=True)
class RowMap:
    """Mean residual over bins of one quantity.

    Attributes:
        quantity: such as ``common_pressure``.
        edges: of the bins [SI], (b + 1,): the lowest row of each, and the highest of the last.
        mean: (b,) measured minus simulated [SI].
        spread: (b,) root mean square of the same.
        rows: names of the rows in each bin.
        p_value: that the quantity says nothing of the residual: one for the whole map, by
            exchanging rows.
        worst: number of the bin that stands out most.
    """

    quantity: str
    edges: FloatArray
    mean: FloatArray
    spread: FloatArray
    rows: tuple[tuple[str, ...], ...]
    p_value: float
    worst: int

    @property
    def region(self) -> tuple[float, float]:
        """Ends of the bin that stands out most [SI]."""
        return float(self.edges[self.worst]), float(self.edges[self.worst + 1])


def row_maps(
    misfit: FloatArray,
    quantities: Mapping[str, FloatArray],
    names: tuple[str, ...],
    *,
    seed: int = 0,
) -> tuple[RowMap, ...]:
    """Map a misfit over every quantity, the surest map first.

    Args:
        misfit: (n,) measured minus simulated [SI], with the sign in which it means something.
        quantities: name -> its values, (n,) [SI].
        names: of the rows.
        seed: of the exchanges.

    Returns:
        One map per quantity that takes different values.
    """
    found: list[RowMap] = []
    for quantity, values in quantities.items():
        bins = _bins(values)
        if bins.max(initial=0) > 0:
            found.append(_map(quantity, values, misfit, bins, names, seed))
    return tuple(sorted(found, key=lambda m: (m.p_value, -float(np.max(np.abs(m.mean))))))


def _bins(values: FloatArray) -> NDArray[np.intp]:
    """Number of each row's bin: about equal counts, equal values together."""
    kinds, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    wanted = max(min(_MOST_BINS, values.size // _FEWEST), 1)
    number, inside = np.zeros(kinds.size, dtype=np.intp), 0
    for k in range(1, kinds.size):
        inside += int(counts[k - 1])
        left = int(counts[k:].sum())
        full = inside >= max(values.size / wanted - 0.5, _FEWEST)
        number[k] = number[k - 1] + (1 if full and left >= _FEWEST else 0)
        inside = 0 if number[k] > number[k - 1] else inside
    return number[place]


def _map(
    quantity: str,
    values: FloatArray,
    misfit: FloatArray,
    bins: NDArray[np.intp],
    names: tuple[str, ...],
    seed: int,
) -> RowMap:
    count = int(bins.max()) + 1
    order = np.lexsort((misfit, values))  # not the order of the table, which means nothing
    member = np.zeros((misfit.size, count))
    member[np.arange(misfit.size), bins[order]] = 1.0
    many = member.sum(axis=0)
    off = (misfit - misfit.mean())[order]

    def standing_out(rows: FloatArray) -> FloatArray:
        # Divided by the root of the count, a bin of a few rows needs a larger mean.
        return np.abs(rows @ member) / np.sqrt(many * (1.0 - many / misfit.size))

    observed = standing_out(off[np.newaxis])[0]
    rng = np.random.default_rng(seed)
    beyond, left = 0, _EXCHANGES
    while left > 0:
        exchanged = rng.permuted(np.tile(off, (min(_BLOCK, left), 1)), axis=1)
        most = standing_out(exchanged).max(axis=1)
        beyond += int(np.sum(most >= observed.max() * (1.0 - 1e-12)))
        left -= _BLOCK
    lows = [float(values[bins == b].min()) for b in range(count)]
    return RowMap(
        quantity=quantity,
        edges=np.array([*lows, float(values.max())]),
        mean=np.array([misfit[bins == b].mean() for b in range(count)]),
        spread=np.array([np.sqrt(np.mean(misfit[bins == b] ** 2)) for b in range(count)]),
        rows=tuple(
            tuple(name for name, b in zip(names, bins, strict=True) if b == number)
            for number in range(count)
        ),
        p_value=(1 + beyond) / (1 + _EXCHANGES),
        worst=int(np.argmax(observed)),
    )
