"""Rows at rest, predicted all at once: tables of angles at rest, and readings of loops.

They give pressures and positions, and no path between: muscle and joint are one link.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pamsim.comparison.chain_runs import COARSE, Values, plain
from pamsim.comparison.links import JOINT, MUSCLE, Link
from pamsim.comparison.trial_prediction import AT_REST
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.inference.blocks import Block, unit_names
from pamsim.inference.coloured_noise import ArNoise
from pamsim.recordings.static_table import StaticTable

AT_REST_LINK = Link((MUSCLE, JOINT))

PredictRest = Callable[[Sequence[Values]], Sequence[FloatArray | None]]
"""Parameters by name [SI], those left out at the rig's own values, to simulated minus measured of
every row, (n,) [SI]; None where there is no prediction."""


@dataclass(frozen=True, kw_only=True)
class Unit:
    """Rows that are left out together, a group by themselves.

    Attributes:
        name: of the unit.
    """

    name: str

    @property
    def trials(self) -> tuple[Unit, ...]:
        """The unit itself, which nothing repeats."""
        return (self,)


class RestSimulator:
    """A predictor of rows as a `pamsim.comparison.link_simulator.LinkSimulator`.

    Args:
        predict: see `PredictRest`.
        blocks: of the rows, in their order.
        inputs: (n, k) of the rows [SI]: what near ones miss together is no noise.
        own_values: of nuisance parameters, as the rig states them [SI].

    Attributes:
        inputs: of the rows, (n, k) [SI].
        links: the one that rows at rest show.
        blocks: of the rows.
        link_of: number of the link of each block, 0.
        repeats: the units.
        stated: residual of the rig as it is, (n,) [SI].

    Raises:
        InputError: if the rig as it is has no prediction for some row.
    """

    def __init__(
        self,
        predict: PredictRest,
        blocks: Sequence[Block],
        inputs: FloatArray,
        own_values: Mapping[str, float],
    ) -> None:
        self._predict, self._own_values = predict, dict(own_values)
        self.blocks, self.inputs = tuple(blocks), inputs
        self.links = (AT_REST_LINK,)
        self.link_of = (0,) * len(self.blocks)
        self.repeats = tuple(Unit(name=name) for name in unit_names(self.blocks))
        (stated,) = self._predicted([{}])
        if stated is None:
            raise InputError(
                f"{self.blocks[0].source}: the rig has no position at rest for some row; check its"
                " parameters and the table's units"
            )
        self.stated = stated

    def own_value(self, name: str) -> float:
        """Value of a nuisance parameter that the rig states [SI]."""
        return self._own_values[name]

    def acts_in(self, names: Collection[str]) -> frozenset[Link]:
        """The link, of any parameter: one without influence changes no row."""
        return frozenset(self.links) if names else frozenset()

    def residuals(
        self,
        sets: Sequence[Values],
        links: Sequence[Collection[Link]],
        others: FloatArray,
        *,
        only: Collection[str] | None = None,
        steps: int = COARSE,
    ) -> list[FloatArray | None]:
        """Residual with each parameter set.

        Args:
            sets: values by name.
            links: of each set, those to predict.
            others: residual (n,) that other rows are taken from [SI].
            only: names of units to predict; all if left out.
            steps: without meaning at rest.

        Returns:
            (n,) [SI] for each; None where some row has no prediction.
        """
        del steps
        wanted = [values for values, own in zip(sets, links, strict=True) if own]
        predicted = iter(self._predicted([{plain(n): v for n, v in s.items()} for s in wanted]))
        found: list[FloatArray | None] = []
        for own in links:
            residual = next(predicted) if own else others
            if residual is not None:
                residual = self._with_rows(others, residual, only)
            found.append(residual)
        return found

    def _predicted(self, sets: Sequence[Values]) -> list[FloatArray | None]:
        return [
            None if residual is None or not np.all(np.isfinite(residual)) else residual
            for residual in self._predict(sets)
        ]

    def _with_rows(
        self, others: FloatArray, residual: FloatArray, only: Collection[str] | None
    ) -> FloatArray:
        whole = others.copy()
        for block in self.blocks:
            if only is None or block.unit in only:
                whole[block.rows] = residual[block.rows]
        return whole


def table_blocks(table: StaticTable, variance: float) -> tuple[Block, ...]:
    """Rows of a table at rest, each a unit of its own.

    Args:
        table: of angles at rest.
        variance: of their noise [rad^2].
    """
    return row_blocks(table.rows, AT_REST, np.full(len(table.rows), variance), source=table.name)


def row_blocks(
    names: Sequence[str], channel: str, variances: FloatArray, *, source: str = ""
) -> tuple[Block, ...]:
    """Rows, each a unit of its own.

    Args:
        names: of the rows.
        channel: what was measured.
        variances: of the noise of each row, (n,) [SI^2].
        source: where they come from.
    """
    return tuple(
        Block(
            unit=row,
            channel=channel,
            rows=slice(i, i + 1),
            noise=ArNoise((), float(variances[i])),
            source=source,
        )
        for i, row in enumerate(names)
    )
