"""How well a shape is learned of what no effect tried explains.

    python scripts/learned_study.py [--count 90] [--seed 0] [--kinds KIND,...] [--workers 2]
        [--stopped] [--json FILE]

Case number i, drawn with seed i, is a recording of the MAS-20 arm as the independent plant
(`tests/plant`) simulates it, with its own equations and integrator. Of every nine, five hide a
torque on the joint: a ripple, a detent, a soft stop, a drag of a power of the speed, or friction
that is smooth in speed. Two hide a tension of both muscles: a swelling, an area that the pressure
pulls on at some contraction, or a knot, a force there without pressure. Effects that could have
such a shape are not among those tried: ripple of a sprocket for torques over the position, friction
of joint and braid for those over the speed, the formulas of the muscles' force for tensions. In the
eighth nothing is hidden; in the last, an effect that is tried. Three inputs, 5 s each, are recorded
three times; every other case, and every knot, has load cells: without them a force over the
contraction is a torque over the position, too.

A shape is right where it runs over the quantity of what is hidden, and over no other. Its error is
the root mean square of learned less true values, over that of the true ones, where the joint or the
muscles have been for 98 % of the time. Finished rows are kept in out/learned_study.

With ``--kinds eccentric,...`` an error of the encoder is hidden as well, of three to eight periods
per turn, as of a pinion off its axis or of a ring of magnets; no error of the angle sensor is
tried. One with a single period is hardly more than a straight line over the arm's range, which
other effects explain. A ``poppet`` is a valve whose flow grows less and less with its opening; no
effect of the valves is tried, and inputs are such as open them in part.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from records import fingerprint, kept_rows, median, study_parser, write_rows

import pamsim
from pamsim.core.computation import versions
from pamsim.core.units import FloatArray, to_si
from pamsim.diagnosis.by_link.curve_places import Kind, contractions
from pamsim.effects.catalog import EFFECTS
from pamsim.recordings.trial import Trial

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.plant.air import lifted
from tests.plant.hidden.catalog import PLANT_EFFECTS
from tests.plant.hidden.hidden_effect import PlantEffect, on_joint, on_muscles
from tests.plant.hidden.sensor_effects import periodic_error
from tests.plant.hide import hide
from tests.plant.joint import free_torque
from tests.plant.read_rig import read_rig

KEPT = Path("out/learned_study")
RIG, INPUTS = "mas20_arm", ("triangle", "staircase", "multisine")
POSITION, SPEED = ("sprocket_ripple",), ("joint_friction", "braid_friction")
CONTRACTION = ("muscle_force", "pressure_force", "stretched_braid")
AROUND = ("eccentric", "poppet")
"""What is hidden around muscles and joint, and drawn only by its name."""

LEFT_OUT = {
    "ripple": POSITION, "detent": POSITION, "stop": POSITION,
    "drag": SPEED, "smooth_friction": SPEED,
    "swelling": CONTRACTION, "knot": CONTRACTION,
    "eccentric": ("angle_sensor",), "poppet": ("valve",),
}  # fmt: skip
"""What is hidden without a name -> families that are not tried."""

KINDS = (*[one for one in LEFT_OUT if one not in AROUND], "nothing", "library")
"""What is drawn in turn, unless named."""

RIGHT = {
    "ripple": Kind.POSITION, "detent": Kind.POSITION, "stop": Kind.POSITION,
    "drag": Kind.RATE, "smooth_friction": Kind.RATE,
    "swelling": Kind.PRESSED, "knot": Kind.UNPRESSED,
    "eccentric": Kind.READING, "poppet": Kind.FLOW,
}  # fmt: skip
"""What is hidden without a name -> the curve that is right."""

OPENINGS = ("pulses", "bursts", "levels")
"""Inputs that open valves by commands, in part and fully, and by regulators."""

MUSCLES = {"swelling": "swell", "knot": "knot"}
"""What is hidden in the muscles -> the field of its size."""

LIBRARY = {"coulomb_friction": 0.5, "chain_backlash": 0.8, "muscle_hysteresis": 1.0}
"""Effect that is tried -> its size in typical ones."""

SI_UNITS = {"deg": "rad", "deg/s": "rad/s", "%": "1", "N*m": "N*m", "N": "N", "N/bar": "m^2"}
"""Unit in which a curve is written -> that of the plant."""

STEP = 7e-4  # of the plant's integrator [s], as in scripts/link_study.py
QUANTILES = (0.01, 0.99)  # of what was visited


def hidden_force(kind: str, rng: np.random.Generator) -> dict[str, float]:
    """Fields of the plant's joint, or of its muscles, see `tests.plant.records`."""
    if kind in MUSCLES:
        force = float(np.exp(rng.uniform(*np.log([10.0, 40.0]))))  # N at 3 bar
        at, width = rng.uniform(-0.015, 0.015), rng.uniform(0.01, 0.025)
        size = force / 3e5 if kind == "swelling" else force
        name = MUSCLES[kind]
        return {name: size, f"{name}_at": at, f"{name}_width": width}
    if kind == "eccentric":
        return {
            "amplitude": np.radians(float(np.exp(rng.uniform(*np.log([0.3, 1.0]))))),
            "periods": rng.uniform(3.0, 8.0),
            "phase": rng.uniform(0.0, 2.0 * np.pi),
        }
    if kind == "poppet":
        return {"lift": float(np.exp(rng.uniform(*np.log([0.4, 1.2]))))}
    at = np.radians(rng.uniform(-10.0, 10.0))
    size = float(np.exp(rng.uniform(*np.log([0.08, 0.3]))))  # N m
    return {
        "ripple": {
            "ripple": size,
            "ripple_periods": 2.0 * np.pi / np.radians(rng.uniform(8.0, 20.0)),
            "ripple_phase": rng.uniform(0.0, 2.0 * np.pi),
        },
        "detent": {
            "detent": size,
            "detent_at": at,
            "detent_width": np.radians(rng.uniform(2.0, 5.0)),
        },
        "stop": {"stop_stiffness": 10.0 * size, "stop_at": at},
        "drag": {"drag": size, "drag_power": rng.uniform(1.3, 2.5)},
        "smooth_friction": {"smooth_dry": size, "smooth_speed": rng.uniform(0.1, 0.4)},
    }[kind]


def true_values(kind: str, fields: Mapping[str, float], at: FloatArray) -> FloatArray:
    """What is hidden at positions [rad], speeds [rad/s], contractions or openings, (n,) [SI]."""
    if kind in MUSCLES:
        size, middle, width = fields.values()
        return size * np.exp(-0.5 * ((at - middle) / width) ** 2)
    if kind == "eccentric":
        return periodic_error(at, **fields)
    if kind == "poppet":
        share = np.maximum(np.abs(at), 1e-6)  # at 0 nothing flows
        return np.array([lifted(one, fields["lift"]) / one - 1.0 for one in share.tolist()])
    without = read_rig(pamsim.load_rig(RIG), 0.0).joint
    there = without.copy()
    for name, value in fields.items():
        there[name] = value
    over_position = LEFT_OUT[kind] == POSITION
    places = [(x, 0.0, 0.0) if over_position else (0.0, x, 0.0) for x in at.tolist()]
    return np.array([free_torque(there[0], *p) - free_torque(without[0], *p) for p in places])


def visited(kind: str, trials: Sequence[Trial]) -> tuple[float, float]:
    """Positions [rad], speeds [rad/s], contractions or openings where the rig mostly was."""
    if kind == "poppet":
        return -1.0, 1.0
    if kind in MUSCLES:
        read = contractions(pamsim.load_rig(RIG), trials)
    else:
        read = [t.measured["angle"] for t in trials]
        if LEFT_OUT.get(kind) == SPEED:
            read = [np.gradient(one, t.time) for one, t in zip(read, trials, strict=True)]
    low, high = np.quantile(np.concatenate([one.ravel() for one in read]), QUANTILES).tolist()
    return low, high


def where(kind: str, fields: Mapping[str, float]) -> dict[str, Any]:
    """What hides it, by the names of `PlantEffect`."""
    if kind == "eccentric":
        error = partial(true_values, kind, fields)
        return {"sensed": lambda run, _: run.with_angle(run.angle + error(run.angle))}
    change = on_muscles if kind in (*MUSCLES, "poppet") else on_joint
    return {"change": change(lambda _: fields)}


def run_one(kind: str, name: str, seed: int) -> dict[str, Any]:
    """Record a case of a rig and diagnose it."""
    rng = np.random.default_rng((seed, 61))
    fields = hidden_force(kind, rng) if kind in LEFT_OUT else {}
    effects: dict[str, float] = {}
    if kind == "library":
        effect = str(rng.choice(list(LIBRARY)))
        effects = {effect: LIBRARY[effect]}
    elif fields:
        PLANT_EFFECTS["unnamed"] = PlantEffect(
            name="unnamed", formulation=kind, unit="1", typical=1.0, **where(kind, fields)
        )
        effects = {"unnamed": 1.0}
    recording = hide(
        name,
        effects,
        protocols=OPENINGS if kind == "poppet" else INPUTS,
        duration=5.0,
        repeats=3,
        forces=bool(seed % 2) or kind == "knot",
        formulation="plant",
        seed=seed,
        step=STEP,
    )
    out = [one for one, e in EFFECTS.items() if e.family in LEFT_OUT.get(kind, ())]
    with tempfile.TemporaryDirectory() as folder:
        recording.save(Path(folder) / "data")
        trials = pamsim.read_recordings(Path(folder) / "data").trials
        begun = time.perf_counter()
        found = pamsim.diagnose(Path(folder) / "data", rig=name, without=out, threads=1)
    seconds = time.perf_counter() - begun
    curves: list[dict[str, Any]] = []
    for one in found.learned:
        at_si, si = (
            to_si(1.0, unit, SI_UNITS[unit], where="curve") for unit in (one.at_unit, one.unit)
        )
        at = one.at * at_si
        low, high = visited(kind, trials) if fields else (at[0], at[-1])
        inside = (at >= low) & (at <= high)
        right = fields and one.kind == RIGHT[kind]
        true = true_values(kind, fields, at) if right else np.zeros(at.size)
        learned, band, true = one.value[inside] * si, one.band95[inside] * si, true[inside]
        curves.append(
            {
                "kind": one.kind,
                "error": float(np.sqrt(np.mean((learned - true) ** 2))),
                "size": float(np.sqrt(np.mean(true**2))),
                "held": float(np.mean((band[:, 0] <= true) & (true <= band[:, 1]))),
                "holds": one.holds,
                "words": one.words,
                "before": one.before,
                "after": one.after,
            }
        )
    return {
        "kind": kind,
        "seed": seed,
        "fields": fields,
        "effects": {one.name: one.level for one in found.effects},
        "learned": curves,
        "seconds": round(seconds, 1),
    }


def counted(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What the study counts."""
    hidden = [row for row in rows if row["kind"] in LEFT_OUT]
    right = [
        row for row in hidden if [one["kind"] for one in row["learned"]] == [RIGHT[row["kind"]]]
    ]
    curves = [row["learned"][0] for row in right]
    per_curve = {
        "error": [one["error"] / one["size"] for one in curves],
        "closed": [(one["before"] - one["after"]) / (one["before"] - 1.0) for one in curves],
    }
    kinds = dict.fromkeys(row["kind"] for row in rows)
    learned = {
        kind: [bool(row["learned"]) for row in rows if row["kind"] == kind] for kind in kinds
    }
    return {
        "hidden": len(hidden),
        "right": len(right),
        **{f"median_{name}": median(values) for name, values in per_curve.items()},
        "band_holds": float(np.mean([one["held"] for one in curves])) if curves else None,
        "learned": {kind: f"{sum(of)} of {len(of)}" for kind, of in learned.items()},
        "median_seconds": median([row["seconds"] for row in rows]),
    }


def main() -> None:
    """Run what is left, count, write."""
    parser = study_parser(__doc__, count=90, seed=0)
    parser.add_argument("--kinds", default=",".join(KINDS), help="what is hidden in turn")
    options = parser.parse_args()
    kinds = options.kinds.split(",")
    seeds = range(options.seed, options.seed + options.count)
    tasks = [(kinds[seed % len(kinds)], RIG, seed) for seed in seeds]
    mark = fingerprint(("pamsim", "tests.plant"), __file__)
    drawn = f"--count {options.count} --seed {options.seed}"
    if options.kinds != parser.get_default("kinds"):
        drawn += f" --kinds {options.kinds}"
    folder = KEPT / drawn.replace("--", "").replace(" ", "_")
    rows = kept_rows(run_one, tasks, folder, mark, options.workers, stopped=options.stopped)
    done = [rows[task] for task in tasks if task in rows]
    result = {
        "schema": "pamsim-learned-study/1",
        "command": f"python scripts/learned_study.py {drawn}",
        **counted(done),
        "versions": versions(),
        "rows": done,
    }
    write_rows(result, options.json)


if __name__ == "__main__":
    main()
