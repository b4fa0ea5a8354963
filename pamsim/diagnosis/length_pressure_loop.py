"""Diagnose a length-pressure loop: whether a reversible law is enough for it, and what opens it."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from pamsim.comparison.loop_simulator import CHANNEL, LOOP_EFFECTS, Loop, LoopRows
from pamsim.core.errors import InputError, nearest
from pamsim.core.units import MM_PER_M, PA_PER_KPA
from pamsim.diagnosis.by_link.diagnose_rest import diagnose_rest
from pamsim.diagnosis.by_link.entries import effect_entries, link_entries
from pamsim.diagnosis.by_link.next_experiment import next_reading
from pamsim.diagnosis.by_link.result import Branches, LinkReport, NextExperiment, Run
from pamsim.diagnosis.options import AS_USUAL, Options
from pamsim.recordings.printed import BRANCHES, arctangent_law, loop_equation, loop_rows

BASE = "the best reversible curve"
"""What stands in the place of a rig."""

RUNS = 3
"""Runs behind each printed mean (Alraouf 2025)."""

PRINTED_LOOPS = {
    "alraouf2025": "the printed means of three runs (Alraouf 2025, Table 2), with their standard"
    " errors",
    "alraouf2025_equations": "the printed branch equations (Alraouf 2025, (3) and (4)) at the"
    " pressures of Table 2: a substitute for readings that are not printed, without their noise",
}
"""Name -> form in which Alraouf 2025 prints its loop."""

_MORE = "more runs of the same loop, with each reading recorded and not their mean alone"
_M_PER_CM = 1e-2  # the file is in cm


def printed_loop(name: str) -> Loop:
    """A loop of Alraouf 2025 by its name in `PRINTED_LOOPS`, up and down again [Pa, m].

    Raises:
        InputError: for another name.
    """
    if name not in PRINTED_LOOPS:
        raise InputError(f"no printed loop {name!r}; {nearest(name, PRINTED_LOOPS)}")
    up, down = (loop_rows(branch) for branch in BRANCHES)
    path, error = (*up, *down[::-1]), None
    if name == "alraouf2025":
        length = np.array([row.mean.value for row in path])
        error = np.array([row.deviation.value for row in path]) * _M_PER_CM / np.sqrt(RUNS)
    else:
        rising, falling = (
            arctangent_law(
                np.array([row.pressure_kpa for row in rows]),
                *(number.value for number in loop_equation(branch)),
            )
            for branch, rows in zip(BRANCHES, (up, down), strict=True)
        )
        length = np.concatenate([rising, falling[::-1]])
    return Loop(
        pressure=np.array([row.pressure_kpa for row in path]) * PA_PER_KPA,
        length=length * _M_PER_CM,
        rising=np.arange(len(path)) < len(up),
        error=error,
    )


def diagnose_length_loop(
    loop: Loop, source: str, options: Options = AS_USUAL, *, warnings: Sequence[str] = ()
) -> LinkReport:
    """Diagnose a length-pressure loop, such as a `printed_loop`.

    Of the effects, those that vanish at rest are tried if named. ``source`` says what the readings
    are, the warnings what a reader should know of them.

    Raises:
        InputError: for an effect that opens no loop, too few pressures that were read on both
            branches, or branches that are the same.
    """
    began = time.perf_counter()
    known = dict.fromkeys(own.effect.name for own in LOOP_EFFECTS)
    for name in options.effects:
        if name not in known:
            raise InputError(f"no effect {name!r} that opens a loop; {nearest(name, known)}")
    named = options.effects or [own.effect.name for own in LOOP_EFFECTS if not own.moving]
    rows = LoopRows(loop, [own for own in LOOP_EFFECTS if own.effect.name in named])
    if not np.any(rows.apart):
        raise InputError(
            f"{source}: rising and falling lengths are the same at every pressure: there is no"
            " hysteresis to explain, or the readings need more digits"
        )
    found = diagnose_rest(
        lambda variance, _: rows.simulator(variance),
        rows.candidates,
        (),
        alpha=options.alpha,
        seed=options.seed,
        progress=options.progress,
    )
    notes = [*warnings, "one loop at one rate cannot separate hysteresis from every kind of creep"]
    if not options.effects:
        notes.append("readings are assumed to be taken at rest, so viscous friction is not tried")
    if loop.error is None:
        notes.append(
            "the readings' errors are not known: their noise is what the best model leaves"
        )
    floor = None if loop.error is None else float(np.sqrt(np.mean(rows.error**2))) * MM_PER_M
    return LinkReport(
        rig=BASE,
        links=link_entries(found),
        effects=effect_entries(None, found),
        gap={CHANNEL: found.gap("mm", MM_PER_M, floor)},
        next_experiment=next_reading(found) if found.effects else NextExperiment(advice=_MORE),
        warnings=tuple(notes),
        alpha=found.limits.alpha,
        material=found.limits.material,
        run=Run(
            data=(source,),
            held_out=tuple(f"{pressure / PA_PER_KPA:g} kPa" for pressure in rows.level),
            effects_tried=len(set(named)),
            skipped={}
            if options.effects
            else {
                own.effect.name: "vanishes at rest; name it if the readings were taken in motion"
                for own in LOOP_EFFECTS
                if own.moving
            },
            seed=options.seed,
            seconds=time.perf_counter() - began,
        ),
        branches=Branches(
            pressure_kpa=rows.level / PA_PER_KPA,
            rising_mm=rows.branches[0] * MM_PER_M,
            falling_mm=rows.branches[1] * MM_PER_M,
            error_mm=None if loop.error is None else rows.error * MM_PER_M,
            opened_mm=rows.opened(found.model.values) * MM_PER_M if found.effects else None,
        ),
    )
