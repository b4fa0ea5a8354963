"""Units: which rows are fitted, which are judged, and what counts as one piece of evidence.

Where enough trials are held out, a trial is a unit. Else trials are cut into parts. Whole trials
are still simulated; rows belong to parts, and a gap as long as the noise remembers separates two
judged parts, and what is fitted from what is judged. If no trial is held out, half of the parts
are.

Parts of a log share what differs from log to log. In one log it cannot be distinguished from what a
model is missing, and flips of the signs of parts would take it for evidence. So it is part of their
noise (`pamsim.diagnosis.by_link.judged_units`): a log's size of each variation is normal, in each
link by itself. Fitted rows are whitened with that, and judged rows by themselves, so that those of
all judged parts are independent, as a flip of signs demands. Fitted and judged parts of one log
still share the variation itself. An effect that looks like it lowers the sum of squares by its
square, in standard deviations: less than what is material unless it is some 4 in 1000 rows. Of
whole trials it is part of the noise where no repeats show it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.comparison.rest_simulator import LinkSimulator
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.diagnosis.by_link.limits import USUAL, Limits
from pamsim.inference.blocks import Block, cut, fitted_runs, most_parts, unit_names, whitened
from pamsim.inference.model_comparison import fewest_units

MOST = 24
"""Parts of all trials together, at most: flips of twelve judged ones reach a p-value of 0.0002, and
longer parts need fewer gaps."""


@dataclass(frozen=True, kw_only=True)
class Rows:
    """Whitened rows of some blocks, one block after the other."""

    blocks: tuple[Block, ...]  # of the rows
    link_of: NDArray[np.intp]  # number of the link of each row, (n,)
    unit_of: NDArray[np.intp]  # number of the unit of each row, (n,)
    group_of: NDArray[np.intp]  # number of the group of repeats of each row, (n,)
    groups: frozenset[str]  # names of the groups of repeats that have to be simulated
    # Rows of each link in each log, and how what varies there is part of their noise
    whitenings: Sequence[tuple[NDArray[np.intp], _Whitening]]

    @property
    def units(self) -> tuple[str, ...]:
        """Names of the units, in the order of `unit_of`."""
        return unit_names(self.blocks)

    def whiten(self, residual: FloatArray) -> FloatArray:
        """Whitened rows (n,) out of a residual (N,) [SI]."""
        if not self.blocks:
            return np.empty(0)
        rows = whitened(self.blocks, residual)
        for own, white in self.whitenings:
            rows[own] = white(rows[own])
        return rows


class Units:
    """Fitted and judged rows of a simulation, of blocks, each with the number of its link.

    Args:
        simulator: of the links.
        fitted, judged: blocks.
        trial_of: unit -> trial; of units that are trials it may be left out.
        input_of: trial -> name of its input; that of its group of repeats if left out.
        varying: (N, k) change of the residual with what differs from log to log, each at its
            standard deviation [SI]; None where repeats show it.
        limits: of what is claimed and reported by them.

    Attributes:
        in_parts: whether units are parts of trials.
        varies: whether what differs from log to log is assumed.
    """

    def __init__(
        self,
        simulator: LinkSimulator,
        fitted: Sequence[tuple[Block, int]],
        judged: Sequence[tuple[Block, int]],
        *,
        trial_of: Mapping[str, str] | None = None,
        input_of: Mapping[str, str] | None = None,
        varying: FloatArray | None = None,
        limits: Limits = USUAL,
    ) -> None:
        self.limits = limits
        self._trial_of = trial_of or {}
        groups = {trial.name: group.name for group in simulator.repeats for trial in group.trials}
        self._input_of = {**groups, **(input_of or {})}
        self.in_parts, self.varies = bool(self._trial_of), varying is not None
        self.fitted = self._rows(simulator, fitted, varying)
        self.judged = self._rows(simulator, judged, varying)

    def trial(self, unit: str) -> str:
        """The trial that a unit is, or is part of."""
        return self._trial_of.get(unit, unit)

    def input(self, unit: str) -> str:
        """Name of a unit's input, which trials that repeat each other share."""
        return self._input_of[self.trial(unit)]

    def _rows(
        self,
        simulator: LinkSimulator,
        pairs: Sequence[tuple[Block, int]],
        varying: FloatArray | None,
    ) -> Rows:
        blocks = tuple(block for block, _ in pairs)
        sizes = [block.size for block in blocks]
        unit = {name: i for i, name in enumerate(unit_names(blocks))}
        group = {t.name: i for i, g in enumerate(simulator.repeats) for t in g.trials}
        of_blocks = [group[self.trial(block.unit)] for block in blocks]
        link_of = np.repeat(np.array([link for _, link in pairs], dtype=np.intp), sizes)
        whitenings: list[tuple[NDArray[np.intp], _Whitening]] = []
        if blocks and varying is not None and varying.shape[1]:
            columns = np.column_stack([whitened(blocks, own) for own in varying.T])
            trial_of = np.repeat([self.trial(block.unit) for block in blocks], sizes)
            for name in np.unique(trial_of):
                for link in np.unique(link_of[trial_of == name]):
                    own = np.flatnonzero((trial_of == name) & (link_of == link))
                    whitenings.append((own, _Whitening(columns[own])))
        return Rows(
            blocks=blocks,
            link_of=link_of,
            unit_of=np.repeat(np.array([unit[b.unit] for b in blocks], dtype=np.intp), sizes),
            group_of=np.repeat(np.array(of_blocks, dtype=np.intp), sizes),
            groups=frozenset(simulator.repeats[i].name for i in of_blocks),
            whitenings=whitenings,
        )


class _Whitening:
    """Rows of covariance ``1 + C C'`` to white ones, by its symmetric root: each stays in place.

    C (n, k) is the change of the rows with what they share, in noise and at its standard deviation.
    """

    def __init__(self, columns: FloatArray) -> None:
        self._along, size, _ = np.linalg.svd(columns, full_matrices=False)
        self._less = 1.0 - 1.0 / np.sqrt(1.0 + size**2)

    def __call__(self, rows: FloatArray) -> FloatArray:
        return rows - self._along @ (self._less * (self._along.T @ rows))


def whole_trials(
    simulator: LinkSimulator,
    held_out: Collection[str],
    *,
    input_of: Mapping[str, str] | None = None,
    varying: FloatArray | None = None,
    limits: Limits = USUAL,
) -> Units:
    """Trials as units, those that are held out to judge by; otherwise as `Units`."""
    pairs = list(zip(simulator.blocks, simulator.link_of, strict=True))
    return Units(
        simulator,
        [(block, link) for block, link in pairs if block.unit not in held_out],
        [(block, link) for block, link in pairs if block.unit in held_out],
        input_of=input_of,
        varying=varying,
        limits=limits,
    )


def parts_of_trials(
    simulator: LinkSimulator,
    held_out: Collection[str],
    *,
    gap: int,
    varying: FloatArray,
    limits: Limits = USUAL,
) -> Units:
    """Parts of trials as units, with gaps of some rows between them; arguments as of `Units`.

    The trials held out are judged; if there are none, half of all parts.

    Raises:
        InputError: trials that are too short for so many parts as the level of judgement needs.
    """
    of_trial: dict[str, list[tuple[Block, int]]] = {}
    for block, link in zip(simulator.blocks, simulator.link_of, strict=True):
        of_trial.setdefault(block.unit, []).append((block, link))
    sizes = {name: own[0][0].size for name, own in of_trial.items()}
    if held_out:
        sizes = {name: size for name, size in sizes.items() if name in held_out}
    counts = _counts(sizes, gap)
    fitted: list[tuple[Block, int]] = []
    judged: list[tuple[Block, int]] = []
    trial_of: dict[str, str] = {}
    number = 0
    for name, own in of_trial.items():
        if name not in counts:
            fitted += own
            continue
        ours = [k for k in range(counts[name]) if held_out or second_half(number + k)]
        number += counts[name]
        for block, link in own:
            every = cut(block, counts[name], gap)
            parts = [every[k] for k in ours]
            judged += [(part, link) for part in parts]
            runs = () if held_out else fitted_runs(block, parts, gap)
            fitted += [(run, link) for run in runs]
            trial_of |= {part.unit: name for part in (*parts, *runs)}
    units = Units(simulator, fitted, judged, trial_of=trial_of, varying=varying, limits=limits)
    fewest = fewest_units(limits.alpha)
    if len(units.judged.units) < fewest or not fitted:
        hold_out = f"hold out {fewest} trials or more, " if held_out else ""
        raise InputError(
            f"too short to judge by: {len(sizes)} trials, together {sum(sizes.values())} samples,"
            f" give {len(units.judged.units)} of the {fewest} independent parts that a level of"
            f" {100.0 * limits.alpha:g} % needs, since their noise is correlated over {gap}"
            f" samples; {hold_out}record more inputs or more repeats, or four times as long"
        )
    return units


def _counts(sizes: Mapping[str, int], gap: int) -> dict[str, int]:
    """Number of parts of each trial: as many as the gap lets it have, of all `MOST` at most."""
    most = {name: most_parts(size, gap) for name, size in sizes.items()}
    share = min(1.0, MOST / sum(most.values()))
    return {name: max(int(share * count), 1) for name, count in most.items()}


def second_half(number: int) -> bool:
    """Whether a unit is in the second half, which is judged.

    Thue and Morse's sequence: no trend and no period sets the halves apart.
    """
    return number.bit_count() % 2 == 1
