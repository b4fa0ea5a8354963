"""Residuals of many trials as one vector, and what each part of it belongs to."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pamsim.core.errors import InputError
from pamsim.sysid.residual_block import BlockPlace, Blocks, layout, stacked

FloatArray = NDArray[np.float64]
Values = Mapping[str, float]

SimulateValues = Callable[[Sequence[Values]], Sequence[Blocks | None]]
"""Rig parameters [SI] by name, those left out at the rig's own values, to residual blocks
(simulated minus measured) of every trial; None where a simulation broke down."""


@dataclass(frozen=True, kw_only=True)
class TrialLayout:
    """What the rows of a stacked residual belong to.

    Attributes:
        places: every channel of every trial.
        held_out: names of the trials that no fit may see.
    """

    places: tuple[BlockPlace, ...]
    held_out: frozenset[str]

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels, in the order of their first trial."""
        return tuple(dict.fromkeys(p.block.channel for p in self.places))

    @property
    def protocol_of(self) -> dict[str, str]:
        """Trial -> protocol."""
        return {p.block.trial: p.block.protocol for p in self.places}

    def trials(self, *, held_out: bool) -> tuple[str, ...]:
        """Names of the trials that are held out, or of those that are fitted."""
        names = dict.fromkeys(p.block.trial for p in self.places)
        return tuple(name for name in names if (name in self.held_out) == held_out)

    def rows(self, trials: Iterable[str]) -> NDArray[np.bool_]:
        """Mask of the rows of some trials, shape (n,)."""
        wanted = set(trials)
        mask = np.zeros(self.places[-1].rows.stop, dtype=bool)
        for place in self.places:
            mask[place.rows] = place.block.trial in wanted
        return mask

    def weights(self, noise: Mapping[str, float]) -> FloatArray:
        """One over each row's noise, shape (n,), so that a channel counts by what it can tell.

        Every channel of a trial has the same say however often it was sampled.

        Args:
            noise: channel -> standard deviation [SI].
        """
        found = np.empty(self.places[-1].rows.stop)
        for place in self.places:
            count = place.block.residual.size
            found[place.rows] = 1.0 / (noise[place.block.channel] * np.sqrt(count))
        return found


@dataclass
class TrialSimulator:
    """A handed-in simulator, with its residuals stacked and its runs counted.

    Attributes:
        simulate: see `SimulateValues`.
        held_out: names of the trials that no fit may see.
        evaluations: parameter sets simulated so far.
    """

    simulate: SimulateValues
    held_out: frozenset[str] = frozenset()
    evaluations: int = 0
    _layout: TrialLayout | None = field(default=None, repr=False)

    @property
    def layout(self) -> TrialLayout:
        """What the rows belong to.

        Raises:
            InputError: if no simulation has come through yet.
        """
        if self._layout is None:
            raise InputError("no simulation has run to its end yet; check the rig's parameters")
        return self._layout

    def many(self, sets: Sequence[Values]) -> list[FloatArray | None]:
        """Stacked residuals of several parameter sets, in one call.

        Args:
            sets: rig parameters by name [SI].

        Returns:
            For each shape (n,) [SI], or None where the simulation broke down.
        """
        self.evaluations += len(sets)
        found: list[FloatArray | None] = []
        for blocks in self.simulate(sets):
            if blocks is not None and self._layout is None:
                self._layout = TrialLayout(places=layout(blocks), held_out=self.held_out)
            found.append(stacked(blocks, self.layout.places) if blocks is not None else None)
        return found
