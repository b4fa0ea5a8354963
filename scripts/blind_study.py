"""How often `pamsim diagnose` is right about effects that an independent plant hides.

    python scripts/blind_study.py --repeats 3|2|4|1 [--first N] [--tier TIER] [--workers 2]
        [--from N] [--stopped] [--json FILE]

Every case of blind_study_cases.json is a recording on disk (five inputs that no diagnosis
contains, in two settings, 5 s at 100 Hz) of a rig as the independent plant simulates it: its own
equations, integrator and steps. It is diagnosed through files, as `pamsim diagnose` does. With
``--repeats 1`` a case is a single log of 20 s: one input, once. Sizes, seeds and order of the cases
were fixed before any was run (blind_study_cases.py); the thresholds are those of the package; what
is counted is defined in blind_study_scores.py. Finished rows are kept in out/blind_study: a
stopped study goes on where it was, as long as the code is the same.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import hashlib
import json
import platform
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import mujoco
from blind_study_cases import DURATION, INPUTS
from blind_study_cases import FILE as CASES
from blind_study_scores import must_show, printed, scores
from kept_rows import Task, as_text, fingerprint, kept_rows

import pamsim
from pamsim.comparison.effects_on_rig import rig_effect, rig_name
from pamsim.core.errors import InputError, SimulationError
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.twins.synthetic_recording import SyntheticRecording

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.plant.hide import hide

KEPT = Path("out/blind_study")
REPEATS = (1, 2, 3, 4)
LOG, LOG_DURATION = "levels", 20.0
"""Input of a single log, and its length [s]."""

STEP = 7e-4
"""Of the plant's integrator [s]; with a quarter of it no sample moves by more than 0.002 of the
sensors' noise."""

REFUSED = {
    "verdict": "refused", "effects": [], "certain": [], "alternatives": [], "resembles": None,
    "explained": None, "gap_over_floor": {"before": None, "after": None}, "absent": {},
}  # fmt: skip
"""Result for data that the diagnosis takes for an error: nothing is claimed."""

Case = Mapping[str, Any]


def cases() -> list[Case]:
    """The committed cases, in their order."""
    return json.loads(CASES.read_text(encoding="utf-8"))["cases"]


def settings(case: Case, repeats: int) -> dict[str, Any]:
    """How the recordings of a case are made."""
    inputs, duration = (INPUTS, DURATION) if repeats > 1 else ((LOG,), LOG_DURATION)
    return {
        "protocols": inputs,
        "duration": duration,
        "repeats": repeats,
        "coloured": case["noise"] == "drifting",
        "quantised": case["noise"] == "quantised",
        "variation": case["variation"],
        "forces": case["forces"],
        "formulation": "plant",
        "seed": case["seed"],
    }


def recorded(rig: Rig, case: Case, repeats: int) -> SyntheticRecording:
    """The recordings of a case; of one log, its first setting alone."""
    made = functools.partial(hide, rig, case["effects"], **settings(case, repeats))
    try:
        hidden = made(step=STEP)
    except SimulationError:  # a lag so short needs the plant's own step
        hidden = made()
    if repeats > 1:
        return hidden
    stem = next(iter(hidden.trials))
    return dataclasses.replace(
        hidden,
        trials={stem: hidden.trials[stem]},
        protocols={stem: hidden.protocols[stem]},
    )


def run_one(kind: str, name: str, seed: int) -> dict[str, str]:
    """Hide, diagnose, and write down what a score needs."""
    (case,) = [c for c in cases() if c["name"] == name]
    rig = pamsim.load_rig(case["rig"])
    with tempfile.TemporaryDirectory() as folder:
        hidden = recorded(rig, case, int(kind.removeprefix("repeats ")))
        truth = json.loads(hidden.save(Path(folder) / "data").read_text(encoding="utf-8"))
        began = time.perf_counter()
        data = str(Path(folder) / "data")
        try:
            found = pamsim.diagnose(data, without=case["removed"], threads=1, seed=seed).to_dict()
        except InputError as error:
            found = {**REFUSED, "refused": str(error)}
        seconds = time.perf_counter() - began
    row = found_row(found, truth, distances(rig, truth))
    return as_text({**row, "seconds": round(seconds, 1)})


def distances(rig: Rig, truth: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Rig parameter -> value that means what was hidden and its neutral value [SI], and by what."""
    found: dict[str, dict[str, Any]] = {}
    for effect in truth["effects"]:
        for name in effect["stands_for"]:
            for parameter in rig_effect(rig, name).parameters:
                full = rig_name(rig, parameter.name)
                if full in truth["parameters"] and not parameter.shape:
                    own = rig_parameter(rig, full).value
                    found[full] = {
                        "truth": truth["parameters"][full]["value"],
                        "neutral": own if parameter.neutral is None else parameter.neutral,
                        "hidden": effect["name"],
                    }
    return found


def found_row(
    result: Mapping[str, Any],
    truth: Mapping[str, Any],
    known: Mapping[str, Mapping[str, Any]],
) -> dict[str, Any]:
    """A diagnosis, as its JSON states it, beside the ground truth."""
    claimed = [name for effect in result["effects"] for name in effect["name"].split("+")]
    others = [name for effect in result["alternatives"] for name in effect["name"].split("+")]
    parameters = {
        name: {"value": estimate["value_si"], "interval95": estimate["interval95_si"]}
        for effect in result["effects"]
        for name, estimate in effect["parameters"].items()
    }
    return {
        "hidden": [
            {
                key: effect[key]
                for key in (
                    "name",
                    "formulation",
                    "stands_for",
                    "families",
                    "resembles",
                    "physical",
                )
            }
            for effect in truth["effects"]
        ],
        "verdict": result["verdict"],
        "refused": result.get("refused"),
        "claimed": sorted(set(claimed)),
        "certain": list(result["certain"]),
        "families": {
            family: {n: {k: q[k] for k in ("value", "interval95")} for n, q in sizes.items()}
            for family, sizes in result.get("certain_families", {}).items()
        },
        "suggested": sorted({*claimed, *others}),
        "nearest": None if result["resembles"] is None else result["resembles"]["name"],
        "explained": result["explained"],
        "tried": [
            ["+".join(model["effects"]), round(model["held_out"], 4)]
            for model in result.get("tried", ())[:8]
        ],
        "gap": result["gap_over_floor"],
        "sizes": {
            name: {**parameters[name], **hidden}
            for name, hidden in known.items()
            if name in parameters
        },
        "physical": [
            {"names": effect["name"].split("+"), "quantities": effect.get("physical", {})}
            for effect in result["effects"]
        ],
        "limits": {
            effect: {
                "limit": entry.get("ruled_out_above_si"),
                "truth": abs(
                    known[entry["parameter"]]["truth"] - known[entry["parameter"]]["neutral"]
                ),
            }
            for effect, entry in result["absent"].items()
            if entry["parameter"] in known
        },
    }


def study(
    repeats: int,
    chosen: Sequence[Case],
    rows: Mapping[Task, dict[str, Any]],
    mark: str,
    begin: int = 1,
) -> dict[str, Any]:
    """The result: scores, and the rows that they were counted from.

    Args:
        repeats: trials of each input in each setting.
        chosen: cases; those without a row are not counted.
        rows: (kind, name, seed) -> row.
        mark: fingerprint of the code that made them.
        begin: number of the first case.
    """
    kind = f"repeats {repeats}"
    pairs = [(c, rows[kind, c["name"], c["seed"]]) for c in chosen if _key(kind, c) in rows]
    return {
        "schema": "pamsim-blind-study/3",
        "command": f"python scripts/blind_study.py --repeats {repeats} --from {begin}",
        "cases": hashlib.sha256(CASES.read_bytes()).hexdigest()[:16],
        "fingerprint": mark,
        "planned": len(cases()),
        "data": {
            "inputs": INPUTS if repeats > 1 else (LOG,),
            "settings_of_each": 2 if repeats > 1 else 1,
            "repeats": repeats,
            "seconds_of_a_trial": DURATION if repeats > 1 else LOG_DURATION,
        },
        "versions": {"mujoco": mujoco.__version__, "python": platform.python_version()},
        "must_show": must_show(pairs, repeats),
        "scores": scores(pairs),
        "rows": [{**case, **row} for case, row in pairs],
    }


def written(result: Mapping[str, Any]) -> str:
    """JSON with a line per case."""
    head = json.dumps({k: v for k, v in result.items() if k != "rows"}, indent=1)
    lines = ",\n".join("  " + json.dumps(row) for row in result["rows"])
    return f'{head[:-2]},\n "rows": [\n{lines}\n ]\n}}\n'


def _key(kind: str, case: Case) -> Task:
    return kind, case["name"], case["seed"]


def main() -> None:
    """Run what is left, score, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, choices=REPEATS, required=True)
    parser.add_argument("--first", type=int, help="number of the last case; all if left out")
    parser.add_argument(
        "--from", dest="begin", type=int, default=1, help="number of the first case"
    )
    parser.add_argument("--tier", default="", help="only cases of this tier")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--stopped", action="store_true", help="score the finished rows only")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    here = Path(__file__).parent
    mark = fingerprint(
        ("pamsim", "tests.plant"),
        __file__,
        CASES,
        here / "blind_study_scores.py",
        *Path("models").glob("*/*.*ml"),
    )
    some = cases()[options.begin - 1 : options.first]
    chosen = [c for c in some if options.tier in ("", c["tier"])]
    tasks = [_key(f"repeats {options.repeats}", case) for case in chosen]
    end = options.begin + len(some) - 1
    folder = KEPT / f"repeats_{options.repeats}_cases_{options.begin}_to_{end}{options.tier}"
    rows = kept_rows(run_one, tasks, folder, mark, options.workers, stopped=options.stopped)
    result = study(options.repeats, chosen, rows, mark, options.begin)
    print(json.dumps(result["scores"], indent=1))
    print(printed(result["must_show"]))
    if options.json is not None:
        options.json.write_text(written(result), encoding="utf-8")


if __name__ == "__main__":
    main()
