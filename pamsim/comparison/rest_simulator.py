"""Rows at rest, predicted all at once: tables of angles at rest, and readings of loops.

They give pressures and positions, and no path between: muscle and joint are one link.

Angles are predicted by the torque balance, which ignores what depends on the path, such as
hysteresis. Its contribution is the difference between a simulation in time and the balance of one
rig, the anchor, and is added for rigs near it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from pamsim.comparison.chain_runs import COARSE, Values, plain
from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.comparison.experiments import table_experiments
from pamsim.comparison.links import JOINT, MUSCLE, Link
from pamsim.comparison.trial_prediction import AT_REST, rest_as_read
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.batch import simulate_batch
from pamsim.engine.equilibrium import rest_angles
from pamsim.engine.rig import Rig
from pamsim.inference.blocks import Block, unit_names
from pamsim.inference.coloured_noise import ArNoise
from pamsim.recordings.recording import Outcome
from pamsim.recordings.sensors import MeasurementChain, read_at_rest, true_at_rest
from pamsim.recordings.static_table import StaticTable

AT_REST_LINK = Link((MUSCLE, JOINT))

PredictRest = Callable[[Sequence[Values]], Sequence[FloatArray | None]]
"""Parameters by name [SI], those left out at the rig's own values, to simulated minus measured of
every row, (n,) [SI]; None where there is no prediction."""


@dataclass(frozen=True, kw_only=True)
class Unit:
    """Rows that are left out together, a group by themselves."""

    name: str  # of the unit

    @property
    def trials(self) -> tuple[Unit, ...]:
        """The unit itself, which nothing repeats."""
        return (self,)


class RestSimulator:
    """A predictor of rows as a `LinkSimulator`.

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
        self.blocks: tuple[Block, ...] = tuple(blocks)
        self.inputs = inputs
        self.links: tuple[Link, ...] = (AT_REST_LINK,)
        self.link_of: tuple[int, ...] = (0,) * len(self.blocks)
        self.repeats = tuple(Unit(name=name) for name in unit_names(self.blocks))
        (stated,) = self._predicted([{}])
        if stated is None:
            raise InputError(
                f"{self.blocks[0].source}: the rig has no position at rest for some row; check its"
                " parameters and the table's units"
            )
        self.stated: FloatArray = stated

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
        """Residual (n,) with each parameter set [SI]; None where some row has no prediction.

        Arguments are those of `ChainSimulator.residuals`; at rest there are no time steps.
        """
        del steps
        wanted = [values for values, own in zip(sets, links, strict=True) if own]
        predicted = iter(self._predicted([{plain(n): v for n, v in s.items()} for s in wanted]))
        found: list[FloatArray | None] = []
        for own in links:
            residual = next(predicted) if own else others
            if residual is not None:
                whole = others.copy()
                for block in self.blocks:
                    if only is None or block.unit in only:
                        whole[block.rows] = residual[block.rows]
                residual = whole
            found.append(residual)
        return found

    def _predicted(self, sets: Sequence[Values]) -> list[FloatArray | None]:
        return [
            None if residual is None or not np.all(np.isfinite(residual)) else residual
            for residual in self._predict(sets)
        ]


LinkSimulator: TypeAlias = ChainSimulator | RestSimulator
"""What a fit of effects needs, of trials or rows at rest: residuals of links as one vector, in
blocks of rows, and groups of units that repeat each other."""


def table_blocks(table: StaticTable, variance: float) -> tuple[Block, ...]:
    """Rows of a table of angles at rest with a variance of their noise [rad^2], each a unit."""
    return row_blocks(table.rows, AT_REST, np.full(len(table.rows), variance), source=table.name)


def row_blocks(
    names: Sequence[str], channel: str, variances: FloatArray, *, source: str = ""
) -> tuple[Block, ...]:
    """Rows of a channel with variances of their noise (n,) [SI^2], each a unit of its own."""
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


class RestPredictor:
    """Predicts the rows of a table with rigs that differ in parameters.

    ``rig_of`` returns the rig of a set of values, or None if there is no such rig.
    """

    def __init__(
        self,
        rig_of: Callable[[Values], Rig | None],
        table: StaticTable,
        *,
        threads: int | None = None,
    ) -> None:
        self._rig_of = rig_of
        self.table = table
        self._threads = threads
        self._experiments = table_experiments(table)
        self._path = np.zeros(len(table.rows))
        self._near: FloatArray | None = None
        self._anchored: dict[tuple[tuple[str, float], ...], tuple[FloatArray, FloatArray]] = {}

    def predict(self, sets: Sequence[Values]) -> list[FloatArray | None]:
        """Simulated minus measured angle of every row, (n,) [rad], for each set of values."""
        return [self._residual(self._rig_of(values)) for values in sets]

    def anchor(self, values: Values) -> None:
        """Simulate these values in time, for the part that depends on the path.

        Raises:
            InputError: if the simulation of a row breaks down.
        """
        key = tuple(sorted(values.items()))
        if key not in self._anchored:
            rig = self._rig_of(values)
            self._near = None
            simulated = None if rig is None else self.simulated(rig)
            if rig is None or simulated is None:
                raise InputError(
                    f"{self.table.name}: a row's simulation breaks down; check the rig's parameters"
                    " and the table's units"
                )
            balanced = self._balanced(rig)
            path = simulated - balanced
            # A row without a balance has no prediction; its anchor must not conceal that.
            known = np.isfinite(path)
            self._anchored[key] = np.where(known, path, 0.0), np.where(known, balanced, 0.0)
        self._path, self._near = self._anchored[key]

    def simulated(self, rig: Rig) -> FloatArray | None:
        """True angles at the ends of the rows' steps simulated in time, (n,) [rad]."""
        runs = simulate_batch(
            [(rig, rest_as_read(rig, e)) for e in self._experiments],
            threads=self._threads,
            above_supply=True,
        )
        if any(run.outcome is not Outcome.COMPLETED for run in runs):
            return None
        return np.array([run.angle[-1] for run in runs])

    def reported(self, rig: Rig, angle: FloatArray) -> FloatArray:
        """True angles as the rig's encoder reports them [rad]."""
        return read_at_rest(angle, rig.sensor or MeasurementChain(), "angle")

    def _residual(self, rig: Rig | None) -> FloatArray | None:
        if rig is None:
            return None
        residual = self.reported(rig, self._balanced(rig) + self._path) - self.table.angle
        return residual if np.all(np.isfinite(residual)) else None

    def _balanced(self, rig: Rig) -> FloatArray:
        pressure = np.asarray(self.table.pressure)
        if rig.sensor is not None:
            pressure = np.maximum(true_at_rest(pressure, rig.sensor, "pressure"), 0.0)
        return rest_angles(rig, pressure, self.table.load, self._near)
