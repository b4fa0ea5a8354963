"""What a diagnosis rests on where trials are few, in sentences."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from pamsim.comparison.link_noise import Output, OutputNoise
from pamsim.comparison.noise_floor import FloorRoute
from pamsim.comparison.repeated_misfit import smallest_p_value
from pamsim.diagnosis.by_link.judged_units import VARIATION, VARYING
from pamsim.diagnosis.by_link.units import Units
from pamsim.inference.model_comparison import fewest_units

_KNOWN_BY = {
    FloorRoute.PERIODS: "by what periods of the command differ by",
    FloorRoute.HOLDS: "while commands are held, about a straight line: slower noise is unseen",
    FloorRoute.WITHIN_TRIALS: "from sample to sample: noise that drifts is unseen",
    FloorRoute.STATED: "as the recording states it: what differs from trial to trial is unseen",
}


def evidence_notes(
    noise: Mapping[Output, OutputNoise], units: Units, alpha: float
) -> tuple[str, ...]:
    """How the noise was estimated, and what is judged, where it is not repeats and trials."""
    notes: list[str] = []
    for source, known in _KNOWN_BY.items():
        channels = dict.fromkeys(c for (_, c), one in noise.items() if one.source is source)
        if channels:
            notes.append(f"without repeats the noise of {', '.join(channels)} is known {known}")
    if units.in_parts:
        notes.append(f"{len(units.judged.units)} parts of trials are judged instead of trials")
    if units.varies:
        notes.append(
            f"{', '.join(VARYING)} are assumed to differ by {100.0 * VARIATION:g} % from log to"
            " log: a larger difference looks like an effect"
        )
    if notes:
        repeated = all(one.source is FloorRoute.REPEATS for one in noise.values())
        notes.append(
            "whether anything is left cannot be decided from parts of trials, so that names are"
            f" certain to the family at most; hold out {fewest_units(alpha)} trials or more"
            if repeated
            else "whether anything is left cannot be decided without repeats, so that names are"
            " certain to the family at most; record every input three times or more"
        )
        return tuple(notes)
    repeats = Counter(units.input(unit) for unit in units.judged.units).values()
    # A held-out trial that no other repeats is judged beside a fitted one.
    least = smallest_p_value(repeats if max(repeats) > 1 else [2] * len(repeats))
    if least <= alpha:
        return ()
    return (
        f"{len(units.judged.units)} held-out trials show what is left at p = {least:.2g} at"
        " best, unless it is large: a gap that is small may be missed; record more repeats",
    )
