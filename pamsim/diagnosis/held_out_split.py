"""The held-out split: what a diagnosis judges by, and never fits."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from pamsim.comparison.measurements import CalibrationData
from pamsim.core.errors import InputError, nearest
from pamsim.recordings.trial import HELD_OUT_SUFFIX


def held_out_split(
    data: CalibrationData, wanted: Sequence[str]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Split off what to judge by.

    Args:
        data: the recordings.
        wanted: names of trials or protocols; if there are none, protocols whose name ends in
            ``_check``, or else every second repeat.

    Returns:
        Names of the trials that are held out, none where every input was recorded once; and
        warnings about the choice.

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
        chosen = set(wanted)
        return tuple(t.name for t in data.trials if {t.name, t.protocol} & chosen), ()
    check = tuple(t.name for t in data.trials if t.protocol.endswith(HELD_OUT_SUFFIX))
    if check:
        return check, ()
    seen: Counter[str] = Counter()
    second: list[str] = []
    for trial in data.trials:
        seen[trial.protocol] += 1
        if seen[trial.protocol] % 2 == 0:
            second.append(trial.name)
    if not second:
        return (), ()
    return tuple(second), (
        "no protocol is held out (by a name that ends in _check, or by choice), so every second"
        " repeat is; this does not show whether the result holds for other inputs",
    )
