"""The held-out split: what a diagnosis judges by, and never fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pamsim.comparison.measurements import CalibrationData
from pamsim.core.errors import InputError, nearest
from pamsim.recordings.trial import HELD_OUT_SUFFIX


@dataclass(frozen=True, kw_only=True)
class HeldOutSplit:
    """What is held out.

    Attributes:
        trials: names of the trials; none where every input was recorded once.
        warnings: about the choice.
    """

    trials: tuple[str, ...]
    warnings: tuple[str, ...] = ()


def held_out_split(data: CalibrationData, wanted: Sequence[str]) -> HeldOutSplit:
    """Split off what to judge by.

    Args:
        data: the recordings.
        wanted: names of trials or protocols; if there are none, protocols whose name ends in
            ``_check``, or else every second repeat.

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
        return HeldOutSplit(
            trials=tuple(t.name for t in data.trials if {t.name, t.protocol} & chosen)
        )
    check = tuple(t.name for t in data.trials if t.protocol.endswith(HELD_OUT_SUFFIX))
    if check:
        return HeldOutSplit(trials=check)
    seen: dict[str, int] = {}
    second: list[str] = []
    for trial in data.trials:
        seen[trial.protocol] = seen.get(trial.protocol, 0) + 1
        if seen[trial.protocol] % 2 == 0:
            second.append(trial.name)
    if not second:
        return HeldOutSplit(trials=())
    return HeldOutSplit(
        trials=tuple(second),
        warnings=(
            "no protocol is held out (by a name that ends in _check, or by choice), so every second"
            " repeat is; this does not show whether the result holds for other inputs",
        ),
    )
