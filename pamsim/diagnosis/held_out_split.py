"""The held-out split: what a diagnosis judges by, and never fits."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from pamsim.comparison.measurements import CalibrationData
from pamsim.comparison.trial_parts import TrialParts, cut_trials
from pamsim.core.errors import InputError, nearest
from pamsim.diagnosis.method.verdict_thresholds import UNREPEATED_GAIN
from pamsim.recordings.trial import HELD_OUT_SUFFIX

FEW_REPEATS = (
    "fewer than two repeats of any input are held out, so parts of trials are judged instead of"
    f" whole ones: what lowers the loss by less than {UNREPEATED_GAIN:g} of the noise variance may"
    " be what differs from trial to trial, and is not claimed"
)


@dataclass(frozen=True, kw_only=True)
class HeldOutSplit:
    """What is held out.

    Attributes:
        trials: names of the trials that are held out whole.
        parts: into which trials are cut where fewer than two of any protocol can be held out; None
            where whole trials are the evidence.
        warnings: about the choice.
    """

    trials: tuple[str, ...]
    parts: TrialParts | None
    warnings: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the trials, or parts of trials, to judge by."""
        if self.parts is None:
            return self.trials
        return tuple(name for name in self.parts.origin if name in self.parts.held_out)


def held_out_split(data: CalibrationData, wanted: Sequence[str]) -> HeldOutSplit:
    """Split off what to judge by.

    Args:
        data: the recordings.
        wanted: names of trials or protocols; if there are none, protocols whose name ends in
            ``_check``, or else every second repeat, and of inputs recorded once parts of the trial.

    Raises:
        InputError: for an unknown name.
    """
    trials, warnings = _held_out_trials(data, wanted)
    chosen = set(trials)
    judged = Counter(t.protocol for t in data.trials if t.name in chosen)
    if any(count > 1 for count in judged.values()):
        return HeldOutSplit(trials=trials, parts=None, warnings=warnings)
    automatic = not wanted and not any(p.endswith(HELD_OUT_SUFFIX) for p in judged)
    parts = cut_trials(data.trials, trials, automatic)
    return HeldOutSplit(trials=trials, parts=parts, warnings=(*warnings, FEW_REPEATS))


def _held_out_trials(
    data: CalibrationData, wanted: Sequence[str]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the trials that are held out whole, and warnings about the choice."""
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
    what = "every second repeat is" if chosen else "parts of every trial are"
    return tuple(chosen), (
        f"no protocol is held out (by a name that ends in _check, or by choice), so {what}; this"
        " does not show whether the result holds for other inputs",
    )
