"""What a fit of effects needs of a simulator, whatever the data: trials, rows at rest, loops."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Protocol

from pamsim.comparison.chain_runs import COARSE, Values
from pamsim.comparison.links import Link
from pamsim.core.units import FloatArray
from pamsim.inference.blocks import Block


class Named(Protocol):
    """A unit of a group."""

    @property
    def name(self) -> str:
        """Of the unit, as its blocks have it."""
        ...


class Group(Named, Protocol):
    """What is simulated together, fitted or held out as a whole."""

    @property
    def trials(self) -> Sequence[Named]:
        """Units of the group: trials that repeat each other, or one row."""
        ...


class LinkSimulator(Protocol):
    """Residuals of links as one vector, simulated minus measured.

    `pamsim.comparison.chain_simulator.ChainSimulator` is one of trials,
    `pamsim.comparison.rest_simulator.RestSimulator` one of rows at rest.

    Attributes:
        links: that the data separate, from the command on.
        blocks: of rows of the residual.
        link_of: number of the link of each block.
        stated: residual of the rig as it is, (n,) [SI].
    """

    links: tuple[Link, ...]
    blocks: tuple[Block, ...]
    link_of: tuple[int, ...]
    stated: FloatArray

    @property
    def repeats(self) -> Sequence[Group]:
        """Groups of units."""
        ...

    def own_value(self, name: str) -> float:
        """Value of a nuisance parameter that the rig states [SI]."""
        ...

    def acts_in(self, names: Collection[str]) -> frozenset[Link]:
        """Links whose outputs parameters change."""
        ...

    def residuals(
        self,
        sets: Sequence[Values],
        links: Sequence[Collection[Link]],
        others: FloatArray,
        *,
        only: Collection[str] | None = None,
        steps: int = COARSE,
    ) -> list[FloatArray | None]:
        """Residual with each parameter set, see `ChainSimulator.residuals`."""
        ...
