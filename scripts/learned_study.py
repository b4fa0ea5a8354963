"""How well a shape is learned of what no effect tried explains.

    python scripts/learned_study.py [--count 210] [--seed 0] [--workers 2] [--stopped] [--json FILE]

Case number i, drawn with seed i, is a recording of the MAS-20 arm as the independent plant
(`tests/plant`) simulates it, with its own equations and integrator. Of every seven, two hide one of
the twelve `HIDDEN` in turn; in two nothing is hidden; in two an effect of the library, by its own
formula and from a half to twice its typical size; in the last two at once: in turn an effect of the
library beside one of the twelve, or two of the twelve. Effects that could have a shape that is
hidden are not among those tried (`HIDDEN`). Three inputs, 5 s each, are recorded three times. Every
other case has load cells, and all with a knot, a cam, or two at once: without them a force over the
contraction is a torque over the position, too.

A shape is right where curves run over the quantities of what is hidden, and over no others; beside
an effect of the library the family of that must be named as well. It is tied where such curves are
among those that the diagnosis says to predict as well as what it learned. A curve's error is the
root mean square of learned less true values, over that of the true ones, where the rig has been for
98 % of the time. Finished rows are kept in out/learned_study.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from link_study_cases import OWN
from records import fingerprint, kept_rows, median, study_parser, write_rows

import pamsim
from pamsim.core.computation import versions
from pamsim.core.units import FloatArray, to_si
from pamsim.diagnosis.by_link.curve_places import Kind
from pamsim.diagnosis.by_link.visited_places import contractions
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

SPEED = ("joint_friction", "braid_friction")
CONTRACTION = ("muscle_force", "pressure_force", "stretched_braid")


@dataclass(frozen=True)
class Hidden:
    """What is hidden without a name: right kinds of curve, and families that are not tried."""

    right: tuple[Kind, ...]
    left_out: tuple[str, ...]
    cells: bool = False  # whether it needs load cells


HIDDEN = {
    "ripple": Hidden((Kind.POSITION,), ("sprocket_ripple",)),
    "drag": Hidden((Kind.RATE,), SPEED),
    "swelling": Hidden((Kind.PRESSED,), CONTRACTION),
    "patch": Hidden((Kind.FRICTION,), SPEED),
    "detent": Hidden((Kind.POSITION,), ("sprocket_ripple",)),
    "poppet": Hidden((Kind.FLOW,), ("valve",)),
    "stop": Hidden((Kind.POSITION,), ("sprocket_ripple",)),
    "cam": Hidden((Kind.ARM,), ("sprocket_ripple",), cells=True),
    "smooth_friction": Hidden((Kind.RATE, Kind.FRICTION), SPEED),
    "eccentric": Hidden((Kind.READING,), ("angle_sensor",)),
    "spring": Hidden(
        (Kind.POSITION,), ("sprocket_ripple", "muscle_force", "stretched_braid"), cells=True
    ),
    "knot": Hidden((Kind.UNPRESSED,), CONTRACTION, cells=True),
}
"""A ripple, a detent, a soft stop and a spring with the angle's cube are torques on the joint over
its position; a drag of a power of the speed and dry friction smooth in speed are over its speed,
the latter a constant dry friction, too; a patch is dry friction about one position. A swelling is
an area of the muscles that the pressure pulls on at some contraction, a knot a force there without
pressure, a cam an arm that is longer about one position. An eccentric encoder errs with three to
eight periods per turn: one with a single period is hardly more than a straight line over the arm's
range, which other effects explain. A poppet is a valve whose flow grows less and less with its
opening; inputs are such as open it in part."""

OPENINGS = ("pulses", "bursts", "levels")
"""Inputs that open valves by commands, in part and fully, and by regulators."""

IN_MUSCLES = {"swelling": "swell", "knot": "knot", "cam": "cam"}
"""What is hidden in the muscles, or their tendons -> the field of its size."""

SI_UNITS = {"deg": "rad", "deg/s": "rad/s", "%": "1", "N*m": "N*m", "N": "N", "N/bar": "m^2"}
"""Unit in which a curve is written -> that of the plant."""

STEP = 7e-4  # of the plant's integrator [s], as in scripts/link_study.py
QUANTILES = (0.01, 0.99)  # of what was visited


def hidden_fields(kind: str, rng: np.random.Generator) -> dict[str, float]:
    """Fields of the plant's joint, of its muscles (`tests.plant.records`), or of the encoder."""
    if kind in ("swelling", "knot"):
        force = spread(rng, 10.0, 40.0)  # N at 3 bar
        at, width = rng.uniform(-0.015, 0.015), rng.uniform(0.01, 0.025)
        size = force / 3e5 if kind == "swelling" else force
        name = IN_MUSCLES[kind]
        return {name: size, f"{name}_at": at, f"{name}_width": width}
    if kind == "eccentric":
        return {
            "amplitude": np.radians(spread(rng, 0.3, 1.0)),
            "periods": rng.uniform(3.0, 8.0),
            "phase": rng.uniform(0.0, 2.0 * np.pi),
        }
    if kind == "poppet":
        return {"lift": spread(rng, 0.4, 1.2)}
    at = np.radians(rng.uniform(-10.0, 10.0))
    if kind == "cam":
        width = np.radians(rng.uniform(6.0, 15.0))
        return {"cam": spread(rng, 0.05, 0.2), "cam_at": at, "cam_width": width}
    size = spread(rng, 0.08, 0.3)  # N m
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
        "spring": {"cube": size / np.radians(12.0) ** 3},
        "drag": {"drag": size, "drag_power": rng.uniform(1.3, 2.5)},
        "smooth_friction": {"smooth_dry": size, "smooth_speed": rng.uniform(0.1, 0.4)},
        "patch": {
            "patch": 2.0 * size,  # for it is not everywhere
            "patch_at": at,
            "patch_width": np.radians(rng.uniform(5.0, 12.0)),
            "patch_speed": rng.uniform(0.02, 0.1),
        },
    }[kind]


def spread(rng: np.random.Generator, low: float, high: float) -> float:
    """A log-uniform number."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def true_values(kind: str, over: Kind, fields: Mapping[str, float], at: FloatArray) -> FloatArray:
    """What is hidden, as a right kind of curve, (n,) [SI].

    It is at positions [rad], speeds [rad/s], contractions or openings, (n,).
    """
    if kind in IN_MUSCLES:
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
    # Dry friction has its full size well above the speed in which it is built up.
    of = {
        "position": lambda x: (x, 0.0, 0.0),
        "speed": lambda x: (0.0, x, 0.0),
        "friction": lambda x: (x, -10.0, 0.0),
    }["friction" if over is Kind.FRICTION else over.over]
    places = map(of, at.tolist())
    return np.array([free_torque(there[0], *p) - free_torque(without[0], *p) for p in places])


def visited(kind: Kind, trials: Sequence[Trial]) -> tuple[float, float]:
    """Positions [rad], speeds [rad/s], contractions or openings where the rig mostly was."""
    if kind.over == "opening":
        return -1.0, 1.0
    if kind.over == "contraction":
        read = contractions(pamsim.load_rig(RIG), trials)
    else:
        read = [t.measured["angle"] for t in trials]
        if kind.over == "speed":
            read = [np.gradient(one, t.time) for one, t in zip(read, trials, strict=True)]
    low, high = np.quantile(np.concatenate([one.ravel() for one in read]), QUANTILES).tolist()
    return low, high


def where(kind: str, fields: Mapping[str, float]) -> dict[str, Any]:
    """What hides it, by the names of `PlantEffect`."""
    if kind == "eccentric":
        error = partial(periodic_error, **fields)
        return {"sensed": lambda run, _: run.with_angle(run.angle + error(run.angle))}
    change = on_muscles if kind in (*IN_MUSCLES, "poppet") else on_joint
    return {"change": change(lambda _: fields)}


def planned(seed: int) -> str:
    """What a case hides, see above: names, or nothing, joined by +."""
    block, place = divmod(seed, 7)
    rng = np.random.default_rng((seed, 62))
    if place < 2:
        return list(HIDDEN)[(2 * block + place) % len(HIDDEN)]
    if place < 4:
        return ""
    if place < 6:
        return str(rng.choice(OWN))
    while True:
        one, other = (
            str(rng.choice(names))
            for names in (OWN if block % 2 else list(HIDDEN), [k for k in HIDDEN if k != "poppet"])
        )
        if one in HIDDEN:
            apart = one != "poppet" and not set(HIDDEN[one].right) & set(HIDDEN[other].right)
        else:
            apart = EFFECTS[one].family not in HIDDEN[other].left_out
        if apart:
            return f"{one}+{other}"


def run_one(kind: str, name: str, seed: int) -> dict[str, Any]:
    """Record a case of a rig, in which what `planned` says is hidden, and diagnose it."""
    rng = np.random.default_rng((seed, 61))
    kinds = kind.split("+") if kind else []
    fields = {one: hidden_fields(one, rng) for one in kinds if one in HIDDEN}
    effects = {one: spread(rng, 0.5, 2.0) for one in kinds if one not in HIDDEN}
    for one, own in fields.items():
        PLANT_EFFECTS[f"hidden_{one}"] = PlantEffect(
            name=f"hidden_{one}", formulation=one, unit="1", typical=1.0, **where(one, own)
        )
    recording = hide(
        name,
        {**effects, **{f"hidden_{one}": 1.0 for one in fields}},
        protocols=OPENINGS if kinds == ["poppet"] else INPUTS,
        duration=5.0,
        repeats=3,
        forces=bool(seed % 2) or len(kinds) > 1 or any(HIDDEN[k].cells for k in fields),
        formulation="plant",
        seed=seed,
        step=STEP,
    )
    left_out = {family for one in fields for family in HIDDEN[one].left_out}
    with tempfile.TemporaryDirectory() as folder:
        recording.save(Path(folder) / "data")
        trials = pamsim.read_recordings(Path(folder) / "data").trials
        begun = time.perf_counter()
        found = pamsim.diagnose(
            Path(folder) / "data",
            rig=name,
            without=[one for one, e in EFFECTS.items() if e.family in left_out],
            threads=1,
        )
    seconds = time.perf_counter() - begun
    of_kind = {right: one for one in fields for right in HIDDEN[one].right}
    curves: list[dict[str, Any]] = []
    for one in found.learned:
        at_si, si = (
            to_si(1.0, unit, SI_UNITS[unit], where="curve") for unit in (one.at_unit, one.unit)
        )
        at = one.at * at_si
        low, high = visited(one.kind, trials)
        inside = (at >= low) & (at <= high)
        hidden = of_kind.get(one.kind)
        true = true_values(hidden, one.kind, fields[hidden], at) if hidden else np.zeros(at.size)
        learned, band, true = one.value[inside] * si, one.band95[inside] * si, true[inside]
        curves.append(
            {
                "kind": one.kind,
                "acts_at": one.acts_at,
                "error": float(np.sqrt(np.mean((learned - true) ** 2))),
                "size": float(np.sqrt(np.mean(true**2))),
                "held": float(np.mean((band[:, 0] <= true) & (true <= band[:, 1]))),
                "holds": one.holds,
                "words": one.words,
                "before": one.before,
                "after": one.after,
            }
        )

    def right(kinds: Collection[str]) -> bool:
        return {of_kind.get(Kind(one), "") for one in kinds} == set(fields)

    named = {EFFECTS[one.name].family for one in found.effects if one.certain["family"]}
    of_effects = {EFFECTS[one].family for one in effects}
    return {
        "hidden": kind,
        "seed": seed,
        "fields": fields,
        "sizes": effects,
        "forces": recording.settings.forces,
        "effects": {one.name: one.level for one in found.effects},
        "learned": curves,
        "tied": found.learned[0].tied if found.learned else (),
        "right": right({one["kind"] for one in curves}) and of_effects <= named,
        "right_or_tied": of_effects <= named
        and any(
            right(kinds)
            for kinds in (
                {one["kind"] for one in curves},
                *(tied.split(" and ") for tied in (found.learned[0].tied if curves else ())),
            )
        ),
        "seconds": round(seconds, 1),
    }


def counted(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What the study counts."""
    of: dict[str, list[Mapping[str, Any]]] = {}
    for row in rows:
        one, _, other = row["hidden"].partition("+")
        tier = "one" if one in HIDDEN else "library" if one else "nothing"
        of.setdefault(("two" if one in HIDDEN else "beside") if other else tier, []).append(row)
    single = of.get("one", [])
    curves = [one for row in single if row["right"] for one in row["learned"]]
    return {
        "right": {tier: shares_of(of.get(tier, []), "right") for tier in ("one", "two", "beside")},
        "right_or_tied": {
            tier: shares_of(of.get(tier, []), "right_or_tied") for tier in ("one", "two", "beside")
        },
        "right_of": {
            kind: shares_of([row for row in single if row["hidden"] == kind], "right")
            for kind in HIDDEN
        },
        "learned": {
            tier: shares_of(of.get(tier, []), "learned") for tier in ("nothing", "library")
        },
        "median_error": median([one["error"] / one["size"] for one in curves]),
        "median_closed": median(
            [(one["before"] - one["after"]) / (one["before"] - 1.0) for one in curves]
        ),
        "band_holds": float(np.mean([one["held"] for one in curves])) if curves else None,
        "median_seconds": {
            tier: median([row["seconds"] for row in some]) for tier, some in of.items()
        },
    }


def page_rows(found: Mapping[str, Any]) -> list[str]:
    """Rows of the table in docs/validation.md, of what `counted` gives."""
    right, tied = found["right"], found["right_or_tied"]
    kinds = ", ".join(
        f"{kind.replace('_', ' ')} {n}"
        for kind, n in found["right_of"].items()
        if not n.endswith(" of 0")
    )
    alone = found["learned"]["library"]
    return [
        f"| one hidden: right quantity and place | {right['one']} (with ties {tied['one']}) |",
        f"| of each kind | {kinds} |",
        f"| two hidden: both right | {right['two']} (with ties {tied['two']}) |",
        f"| one beside an effect of the library: both right | {right['beside']}"
        f" (with ties {tied['beside']}) |",
        f"| a curve is learned with nothing hidden | {found['learned']['nothing']} |",
        f"| a curve is learned with an effect of the library alone | {alone} |",
        f"| error of right curves, median | {100 * found['median_error']:.1f} % |",
        f"| gap closed by them, median | {100 * found['median_closed']:.1f} % |",
        f"| places where their band contains what is hidden | {100 * found['band_holds']:.1f} % |",
    ]


def shares_of(rows: Sequence[Mapping[str, Any]], what: str) -> str:
    """Of how many rows something is true."""
    return f"{sum(bool(row[what]) for row in rows)} of {len(rows)}"


def main() -> None:
    """Run what is left, count, write."""
    options = study_parser(__doc__, count=210, seed=0).parse_args()
    seeds = range(options.seed, options.seed + options.count)
    tasks = [(planned(seed), RIG, seed) for seed in seeds]
    mark = fingerprint(("pamsim", "tests.plant"), __file__)
    drawn = f"--count {options.count} --seed {options.seed}"
    folder = KEPT / str(options.seed)
    rows = kept_rows(run_one, tasks, folder, mark, options.workers, stopped=options.stopped)
    done = [rows[task] for task in tasks if task in rows]
    result = {
        "schema": "pamsim-learned-study/2",
        "command": f"python scripts/learned_study.py {drawn}",
        **counted(done),
        "versions": versions(),
        "rows": done,
    }
    write_rows(result, options.json)


if __name__ == "__main__":
    main()
