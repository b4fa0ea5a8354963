"""The held-out split: which trials a diagnosis judges by, and never fits."""

from __future__ import annotations

from collections.abc import Sequence

from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.protocols import HELD_OUT_SUFFIX
from pamsim.core.errors import InputError, nearest


def held_out_trials(
    data: CalibrationData, wanted: Sequence[str]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Split off the trials to judge by.

    Args:
        data: the recordings.
        wanted: names of trials or protocols; if there are none, protocols whose name ends in
            ``_check``, or else every second repeat.

    Returns:
        Names of the trials, and warnings about the choice.

    Raises:
        InputError: for an unknown name.
    """
    if wanted:
        known = {t.name for t in data.trials} | {t.protocol for t in data.trials}
        for name in wanted:
            if name not in known:
                raise InputError(
                    f"`hold_out` {name}: no trial of that name; {nearest(name, known)}"
                )
        return tuple(t.name for t in data.trials if {t.name, t.protocol} & set(wanted)), ()
    check = tuple(t.name for t in data.trials if t.protocol.endswith(HELD_OUT_SUFFIX))
    if check:
        return check, ()
    seen: dict[str, int] = {}
    chosen: list[str] = []
    for trial in data.trials:
        seen[trial.protocol] = seen.get(trial.protocol, 0) + 1
        if seen[trial.protocol] % 2 == 0:
            chosen.append(trial.name)
    return tuple(chosen), (
        "no protocol is held out (by a name that ends in _check, or by choice), so every second"
        " repeat is; this does not show whether the result holds for other inputs",
    )
