"""The rows of a table of angles at rest as experiments to simulate."""

from __future__ import annotations

import numpy as np

from pamsim.core.experiment import Experiment, pressure_step
from pamsim.store.static_table import StaticTable

REST_DURATION = 6.0
"""Time given to a step whose end is an angle at rest [s]: ten times the MAS-20's slow lag."""

_REST_HZ = 20.0


def table_experiments(table: StaticTable) -> list[Experiment]:
    """The steps behind the rows of a static table.

    Where the table does not say from which pressures a row started, all muscles rest at its highest
    pressure before the others are vented: the operating concept of Matiskova 2021, section 3.1.
    """
    start = table.start
    if start is None:
        start = np.broadcast_to(table.pressure.max(axis=1, keepdims=True), table.pressure.shape)
    return [
        pressure_step(
            before,
            after,
            duration=REST_DURATION,
            load=float(load),
            sample_rate=_REST_HZ,
            name=f"{table.name}, {row}",
        )
        for row, before, after, load in zip(
            table.rows, start, table.pressure, table.load, strict=True
        )
    ]
