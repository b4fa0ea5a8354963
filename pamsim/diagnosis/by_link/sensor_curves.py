"""An error of the sensor of a rig's joint over the true position: between which positions."""

from __future__ import annotations

from collections.abc import Sequence

from pamsim.diagnosis.by_link.even_curves import EvenPlace
from pamsim.diagnosis.by_link.joint_curves import between, smoothed_readings
from pamsim.diagnosis.by_link.learned_curve import Kind
from pamsim.engine.rig import Rig
from pamsim.recordings.sensors import CONTROLS
from pamsim.recordings.trial import Trial

_NAME = "sensor.learned_"


def sensor_place(rig: Rig, trials: Sequence[Trial]) -> EvenPlace | None:
    """The sensor of a rig's only joint; None of several, if it has a curve, or is not recorded.

    A rig states one error for the sensors of all of its joints, which curves would not share.
    """
    if len(rig.joints) > 1 or (rig.sensor is not None and rig.sensor.learns):
        return None
    (joint,) = rig.joints
    channel = rig.names.joint_channel(joint)
    seen = [trial for trial in trials if channel in trial.measured]
    if not seen:
        return None
    low, high = between(smoothed_readings(seen, channel))
    fields = {Kind.READING: _NAME}
    return EvenPlace(
        acts_at=joint, ends_at=_NAME, low=low, high=high, fields=fields, count=CONTROLS
    )
