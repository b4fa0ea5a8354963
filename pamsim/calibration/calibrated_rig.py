"""What a calibration writes into the rig's file: numbers, sources, and what to think of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pamsim.comparison.free_parameters import FreedParameter
from pamsim.comparison.measurements import CalibrationData
from pamsim.core.parameters import Sourced
from pamsim.inference.coefficient import Doubt
from pamsim.inference.fit_result import Calibration


def calibrated_numbers(
    freed: Sequence[FreedParameter], found: Calibration, data: CalibrationData
) -> dict[str, Sourced]:
    """The calibrated numbers as entries of the rig's file; what no datum shows stays as it was.

    Args:
        freed: the parameters.
        found: the calibration, in the same order.
        data: what it rests on.

    Returns:
        Name of every rig parameter that changes -> its entry [SI].
    """
    source = f"identified by pamsim calibrate from {_short(data)}"
    numbers: dict[str, Sourced] = {}
    for one, result in zip(freed, found.parameters, strict=True):
        if Doubt.DEAD in result.doubts:
            continue
        for name in one.names:
            tied = [other for other in one.names if other != name]
            notes = [f"one number with {', '.join(tied)}"] if tied else []
            notes += [result.sentence] if result.sentence else []
            numbers[name] = Sourced(
                value=result.value,
                unit=result.unit,
                source=source,
                where=f"calibrated {name}",
                interval95=result.interval95,
                note="; ".join(notes),
            )
    return numbers


def calibration_heading(data: CalibrationData, found: Calibration) -> str:
    """Comment for the top of the calibrated rig's file."""
    return (
        f"Written by pamsim calibrate from {_short(data)}.\n"
        f"Status: {found.status}: {found.sentence}.\n"
        "Everything below that does not say so is as it was in the rig it started from."
    )


def _short(data: CalibrationData) -> str:
    return ", ".join(Path(source).name or source for source in data.sources)
