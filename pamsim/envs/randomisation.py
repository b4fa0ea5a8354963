"""Domain randomisation: parameters drawn within the uncertainty that the rig states."""

from __future__ import annotations

from dataclasses import dataclass

from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig

_NORMAL95 = 1.959964
"""Standard deviations from the centre of a 95 % interval to its ends."""


@dataclass(frozen=True, kw_only=True)
class RandomParameter:
    """A parameter drawn for every episode.

    Attributes:
        name: as `Rig.with_parameters` takes it.
        value: centre [SI].
        sd: standard deviation [SI].
        low: smallest allowed value.
        high: largest.
    """

    name: str
    value: float
    sd: float
    low: float
    high: float


def random_parameters(rig: Rig) -> list[RandomParameter]:
    """The parameters that a rig's file states with a 95 % interval.

    The dead time of the valves is left out: commands are delayed by whole time steps.
    """
    file = rig.file
    names = [f"{group}.{field}" for group, section in file.muscle.items() for field in section]
    names += [
        f"{muscle}:{group}.{field}"
        for muscle, groups in file.overrides.items()
        for group, section in groups.items()
        for field in section
    ]
    names += [*file.native, *(f"sensor.{field}" for field in file.sensor)]
    drawn: list[RandomParameter] = []
    for name in names:
        if name.endswith((".law", "valve.delay")):
            continue
        known = rig_parameter(rig, name)
        if known.interval95 is None:
            continue
        low, high = known.interval95
        drawn.append(
            RandomParameter(
                name=name,
                value=known.value,
                sd=abs(high - low) / (2.0 * _NORMAL95),
                low=known.spec.low,
                high=known.spec.high,
            )
        )
    return drawn
