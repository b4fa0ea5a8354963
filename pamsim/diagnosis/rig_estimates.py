"""Fitted parameters and limits of a rig, in the units of its file."""

from __future__ import annotations

import math
from collections.abc import Iterable

from pamsim.comparison.readable_unit import readable, readable_interval, readable_unit
from pamsim.diagnosis.method.absent_limits import NOT_SHOWN, AbsentLimit
from pamsim.diagnosis.method.trial_model import TrialModel
from pamsim.diagnosis.result import AbsentEntry, Estimate
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig


def estimates(rig: Rig, model: TrialModel, names: Iterable[str]) -> dict[str, Estimate]:
    """Fitted parameters of a rig.

    Args:
        rig: without effects.
        model: that was fitted.
        names: of the parameters.
    """
    intervals = model.intervals
    entries: dict[str, Estimate] = {}
    for name in names:
        parameter = rig_parameter(rig, name)
        value, interval95 = model.fit.values[name], intervals.get(name)
        entries[name] = Estimate(
            value=readable(parameter, value),
            unit=readable_unit(parameter),
            interval95=readable_interval(parameter, interval95),
            value_si=float(value),
            unit_si=parameter.spec.unit,
            interval95_si=interval95,
            before=readable(parameter, parameter.value),
            at_bound=name in model.fit.at_bound,
        )
    return entries


def absent_entry(rig: Rig, absent: AbsentLimit) -> AbsentEntry:
    """How large an absent effect could be, as a distance in the unit of the rig's file."""
    parameter = rig_parameter(rig, absent.parameter)
    known = absent.cannot_tell is None and math.isfinite(absent.limit)
    # A distance: what the unit's zero is does not matter.
    distance = readable(parameter, absent.limit) - readable(parameter, 0.0) if known else None
    return AbsentEntry(
        parameter=absent.parameter,
        limit=distance,
        unit=readable_unit(parameter),
        limit_si=absent.limit if known else None,
        typical_sizes=absent.size,
        because=None if known else absent.cannot_tell or NOT_SHOWN,
    )
