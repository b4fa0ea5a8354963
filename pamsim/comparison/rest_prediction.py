"""Angles at rest in the rows of a static table, predicted by the torque balance.

The balance ignores what depends on the path, such as hysteresis. Its contribution is the difference
between a simulation in time and the balance of one rig, the anchor, and is added for rigs near it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from pamsim.comparison.experiments import table_experiments
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.batch import simulate_batch
from pamsim.engine.equilibrium import rest_angles
from pamsim.engine.rig import Rig
from pamsim.recordings.recording import Outcome
from pamsim.recordings.sensors import MeasurementChain, read_at_rest, true_at_rest
from pamsim.recordings.static_table import StaticTable

Values = Mapping[str, float]


class RestPredictor:
    """Predicts the rows of a table with rigs that differ in parameters.

    Args:
        rig_of: returns the rig of a set of values, or None if there is no such rig.
        table: rows to predict.
        threads: simulations at a time; None for one per processor.

    Attributes:
        simulations: rows simulated in time so far.
        balances: rows solved for their balance so far.
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
        self.simulations = 0
        self.balances = 0

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
        self.simulations += len(self._experiments)
        runs = simulate_batch(
            [(rig, e) for e in self._experiments], threads=self._threads, above_supply=True
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
        self.balances += len(self.table.rows)
        pressure = np.asarray(self.table.pressure)
        if rig.sensor is not None:
            pressure = np.maximum(true_at_rest(pressure, rig.sensor, "pressure"), 0.0)
        return rest_angles(rig, pressure, self.table.load, self._near)
