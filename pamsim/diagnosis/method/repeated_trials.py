"""Trials that repeat each other, and the directions in which they differ.

Parameters that vary from trial to trial would hide a small remainder, or look like one. They are
projected out of each trial: those directions, of several known ones, in which the trials of a
protocol differ.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.signature import TangentSpace
from pamsim.inference.residual_block import BlockPlace

_VARYING = 0.02
"""Share of the trials' scatter from which they are held to differ in a direction."""

_DIRECTIONS = 8
"""Most directions that are projected out."""


@dataclass
class RepeatedTrial:
    """A trial's residual and directions, both without what has been projected out so far.

    Attributes:
        protocol: of it.
        residual: (n,) its squares sum to the trial's loss.
        directions: (n, k) changes of it that may vary from trial to trial.
        name: of the trial.
    """

    protocol: str
    residual: FloatArray
    directions: FloatArray
    name: str = ""

    def project_out(self, columns: FloatArray) -> None:
        """Project residual and directions onto the orthogonal complement of columns (n, b)."""
        space = TangentSpace(columns)
        self.residual = space.project_out(self.residual)
        self.directions = space.project_out(self.directions)

    def unit_directions(self) -> FloatArray:
        """Directions of length 1, shape (n, k); 0 where nothing is left of one."""
        norms = np.linalg.norm(self.directions, axis=0)
        kept = norms > 1e-9 * max(float(norms.max(initial=0.0)), np.finfo(float).tiny)
        return self.directions * np.where(kept, 1.0 / np.where(kept, norms, 1.0), 0.0)


def project_out_variation(trials: Sequence[RepeatedTrial]) -> list[int]:
    """Project out the directions in which the trials of a protocol differ, the strongest first.

    Returns:
        The numbers of these directions, in their order.
    """
    found: list[int] = []
    for _ in range(_DIRECTIONS if trials else 0):
        varying = _most_varying(trials)
        if varying is None:
            break
        found.append(varying)
        for trial in trials:
            trial.project_out(trial.unit_directions()[:, [varying]])
    return found


def _most_varying(trials: Sequence[RepeatedTrial]) -> int | None:
    """Direction in which the trials of a protocol differ most; None if none exceeds the share."""
    total, explained = 0.0, np.zeros(trials[0].directions.shape[1])
    for protocol in dict.fromkeys(t.protocol for t in trials):
        members = [t for t in trials if t.protocol == protocol]
        mean = np.mean([t.residual for t in members], axis=0)
        for trial in members:
            scatter = trial.residual - mean
            total += float(scatter @ scatter)
            explained += (trial.unit_directions().T @ scatter) ** 2
    if not explained.size or not total > 0.0 or explained.max() < _VARYING * total:
        return None
    return int(np.argmax(explained))


def repeated_rows(places: Iterable[BlockPlace]) -> dict[str, dict[str, NDArray[np.intp]]]:
    """Protocol -> trial -> its rows, cut to what all trials of the protocol have.

    Protocols with a single trial are left out.
    """
    rows: dict[str, dict[str, dict[str, slice]]] = {}
    for place in places:
        block = place.block
        rows.setdefault(block.protocol, {}).setdefault(block.trial, {})[block.channel] = place.rows
    repeated: dict[str, dict[str, NDArray[np.intp]]] = {}
    for protocol, trials in rows.items():
        if len(trials) < 2:
            continue
        parts = list(trials.values())
        shared = [c for c in parts[0] if all(c in channels for channels in parts)]
        counts = {c: min(p[c].stop - p[c].start for p in parts) for c in shared}
        if shared:
            repeated[protocol] = {
                trial: np.concatenate(
                    [np.arange(p[c].start, p[c].start + counts[c]) for c in shared]
                )
                for trial, p in trials.items()
            }
    return repeated
