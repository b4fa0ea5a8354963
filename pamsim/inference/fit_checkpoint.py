"""Checkpoint of a fit to trials: finished starts and the one in progress."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from pamsim.core.errors import InputError
from pamsim.inference.batched_residual import BatchedResidual
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.search import SearchEnd, SearchState
from pamsim.inference.simulator_fit import Checkpoint

_SAME = 1e-6  # relative difference of numbers of one fit, written and read


class FitState:
    """What is not lost when a fit is interrupted.

    Args:
        checkpoint: where it is kept, or None to keep nothing.
        identity: what the fit is about; a state with another identity is refused.
        residual: whose counters are carried on.

    Raises:
        InputError: the checkpoint belongs to another fit.
    """

    def __init__(
        self, checkpoint: Checkpoint | None, identity: Mapping[str, Any], residual: BatchedResidual
    ) -> None:
        self._checkpoint, self._identity, self._residual = checkpoint, identity, residual
        self.finished: list[SearchEnd] = []
        self.current: SearchState | None = None
        saved = None if checkpoint is None else checkpoint.load()
        if saved is None:
            return
        for what, now in identity.items():
            if not _equal(saved.get("identity", {}).get(what), now):
                raise InputError(
                    f"the checkpoint belongs to another fit: its {what} differ; remove it"
                    " to start again"
                )
        self.finished = [_end(end) for end in saved["finished"]]
        self.current = None if saved["current"] is None else _state(saved["current"])
        residual.evaluations += saved["evaluations"]
        residual.calls += saved["calls"]
        residual.diverged += saved["diverged"]

    def reached(self, state: SearchState) -> None:
        """Keep where the current start stands."""
        self.current = state
        self._save()

    def finish(self, end: SearchEnd) -> None:
        """Keep where the current start ended."""
        self.finished.append(end)
        self.current = None
        self._save()

    def _save(self) -> None:
        if self._checkpoint is None:
            return
        self._checkpoint.save(
            {
                "identity": dict(self._identity),
                "finished": [
                    {"state": _plain(e.state), "objective": e.objective, "converged": e.converged}
                    for e in self.finished
                ],
                "current": None if self.current is None else _plain(self.current),
                "evaluations": self._residual.evaluations,
                "calls": self._residual.calls,
                "diverged": self._residual.diverged,
            }
        )


def identity(
    residual: BatchedResidual,
    parameters: Sequence[FreeParameter],
    first: Mapping[str, float],
    options: Mapping[str, Any],
) -> dict[str, Any]:
    """Describe what a fit is about, JSON-safe.

    Args:
        residual: the simulator.
        parameters: p of them.
        first: channel -> noise estimated at the first start, which identifies the data.
        options: that its result depends on.
    """
    return {
        "parameters": [asdict(p) for p in parameters],
        "trials": [
            [p.block.trial, p.block.channel, p.block.residual.size] for p in residual.places
        ],
        "residuals": dict(first),
        "options": dict(options),
    }


def _plain(state: SearchState) -> dict[str, Any]:
    return {**asdict(state), "place": state.place.tolist(), "noise": dict(state.noise)}


def _state(saved: Mapping[str, Any]) -> SearchState:
    return SearchState(**{**saved, "place": np.array(saved["place"], dtype=np.float64)})


def _end(saved: Mapping[str, Any]) -> SearchEnd:
    return SearchEnd(_state(saved["state"]), saved["objective"], saved["converged"])


def _equal(saved: Any, now: Any) -> bool:
    if isinstance(saved, Mapping) and isinstance(now, Mapping):
        return saved.keys() == now.keys() and all(_equal(saved[k], now[k]) for k in saved)
    if isinstance(saved, (list, tuple)) and isinstance(now, (list, tuple)):
        return len(saved) == len(now) and all(map(_equal, saved, now))
    if isinstance(saved, float) and isinstance(now, float):
        return abs(saved - now) <= _SAME * max(abs(saved), abs(now))
    return saved == now
