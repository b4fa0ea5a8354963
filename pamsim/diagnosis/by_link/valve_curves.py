"""A change of the flow of all valves over their opening: between which openings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pamsim.diagnosis.by_link.even_curves import EvenPlace
from pamsim.diagnosis.by_link.learned_curve import ALL_VALVES, Kind
from pamsim.engine.rig import Rig
from pamsim.physics.valves import CONTROLS, learns_flow
from pamsim.recordings.trial import Trial

_NAME = "valve.learned_"


def valve_place(rig: Rig, trials: Sequence[Trial]) -> EvenPlace | None:
    """The valves of a rig; None if one has a curve or pulses, or none opens.

    A valve that pulses is open or shut. Which openings a regulator has commanded is not recorded:
    all may have been visited.
    """
    kinds = {kind for trial in trials for kind in trial.drives.muscles}
    if "pulse" in kinds or any(learns_flow(one.valve) for one in rig.muscles.values()):
        return None
    ends = [end for trial in trials for end in _visited(trial)]
    low, high = min(ends, default=0.0), max(ends, default=0.0)
    if not high > low:
        return None
    fields = {Kind.FLOW: _NAME}
    return EvenPlace(
        acts_at=ALL_VALVES, ends_at=_NAME, low=low, high=high, fields=fields, count=CONTROLS
    )


def _visited(trial: Trial) -> Iterator[float]:
    for column, kind in zip(trial.command.T, trial.drives.muscles, strict=False):
        if kind == "pressure_set":
            yield from (-1.0, 1.0)
        elif kind == "valve":
            yield from np.clip([column.min(), column.max()], -1.0, 1.0).tolist()
