"""How often the diagnosis by link is right about effects that an independent plant hides.

    python scripts/link_study.py [--cases FILE] [--repeats 3|2|1] [--from N] [--to N]
        [--tier TIER] [--log levels] [--seconds 20] [--workers 2] [--threads 1] [--stopped]
        [--json FILE]

Every case is a recording on disk (five inputs that no diagnosis contains, in two settings, 5 s at
100 Hz) of a rig as the independent plant simulates it: its own equations, integrator and steps. It
is read from there. With ``--repeats 1`` a case is a single log of one input, such as ``levels``, or
``multisine``, which repeats every 4 s: its noise is compared with what was added. What is counted
is defined in link_study_scores.py. Finished rows are kept in out/link_study: a stopped study goes
on where it was, as long as the code is the same.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from link_study_cases import DURATION, INPUTS, plant_recording
from link_study_cases import FILE as CASES
from link_study_scores import must_show, must_show_of_one_log, table
from records import fingerprint, head, kept_rows, read, study_parser, write_rows

import pamsim
from pamsim.comparison.chain_simulator import ChainSimulator
from pamsim.comparison.effects_on_rig import candidates, rig_effect, rig_name
from pamsim.comparison.links import whole_run
from pamsim.comparison.measurements import CalibrationData, read_calibration_data
from pamsim.comparison.repeats import repeats
from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link.diagnose_links import LinkDiagnosis, diagnose_links
from pamsim.diagnosis.by_link.judged_units import held_out_split
from pamsim.diagnosis.options import NUISANCE
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.recordings.trial import Trial
from pamsim.twins.synthetic_recording import SyntheticRecording

KEPT = Path("out/link_study")
LOG, LOG_DURATION = "levels", 20.0
"""Input of a single log, and its length [s], if left out."""

STEP = 7e-4
"""Of the plant's integrator [s]; with a quarter of it no sample moves by more than 0.002 of the
sensors' noise."""

Case = Mapping[str, Any]


def settings(case: Case, repeats: int, log: str, seconds: float) -> dict[str, Any]:
    """How the recordings of a case are made."""
    inputs, duration = (INPUTS, DURATION) if repeats > 1 else ((log,), seconds)
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


def recorded(rig: Rig, case: Case, how: Mapping[str, Any]) -> SyntheticRecording:
    """The recordings of a case as `settings` say; of one log, its first setting alone."""
    hidden = plant_recording(rig, case["effects"], STEP, **how)
    if how["repeats"] > 1:
        return hidden
    stem = next(iter(hidden.trials))
    return dataclasses.replace(
        hidden,
        trials={stem: hidden.trials[stem]},
        protocols={stem: hidden.protocols[stem]},
    )


def read_back(
    rig: Rig, hidden: SyntheticRecording, folder: Path
) -> tuple[CalibrationData, dict[str, Any]]:
    """A recording as it is read from a folder, and its ground truth."""
    truth = read(hidden.save(folder))
    return read_calibration_data([str(folder)]).of_rig(rig), truth


def run_one(kind: str, name: str, seed: int) -> dict[str, Any]:
    """Record a case, diagnose it link by link, and write down what was found."""
    count, threads, log, seconds, file = kind.split(" ", 4)
    (case,) = [c for c in read(Path(file))["cases"] if c["name"] == name]
    rig = pamsim.load_rig(case["rig"])
    how = settings(case, int(count), log, float(seconds))
    with tempfile.TemporaryDirectory() as folder:
        data, truth = read_back(rig, recorded(rig, case, how), Path(folder) / "data")
        floor: dict[str, Any] = {}
        if count == "1":
            without = recorded(rig, case, {**how, "noise": 0.0, "quantised": False})
            clean, _ = read_back(rig, without, Path(folder) / "without")
            floor = {"floor": floors(rig, data.trials, clean.trials)}
    kept = ("name", "formulation", "stands_for", "families", "resembles")
    known = distances(rig, truth)
    about = {
        **floor,
        "hidden": [{key: one[key] for key in kept} for one in truth["effects"]],
        "truth": {n: [one["truth"], one["neutral"], one["hidden"]] for n, one in known.items()},
    }
    began = time.perf_counter()
    try:
        found = diagnose_links(
            rig,
            data.trials,
            candidates(rig, (), case["removed"])[0],
            held_out=held_out_split(data, ())[0],
            nuisance=NUISANCE,
            seed=seed,
            threads=int(threads),
        )
    except InputError as error:  # such as too few parts to judge by
        return {**about, "refused": str(error), "links": {}, "effects": [], "sizes": {}}
    return {**row(found), **about, "seconds": round(time.perf_counter() - began, 1)}


def floors(rig: Rig, trials: Sequence[Trial], clean: Sequence[Trial]) -> dict[str, float]:
    """Channel -> noise as estimated for the whole chain, over what was added to a recording."""
    chain = ChainSimulator(rig, repeats(trials), divided=whole_run, threads=1)
    (noisy,), (exact,) = trials, clean
    added = {name: noisy.measured[name] - signal for name, signal in exact.measured.items()}
    return {
        channel: _rounded(
            one.noise.standard_deviation / float(np.sqrt(np.mean(added[channel] ** 2)))
        )
        for (_, channel), one in chain.noise.items()
    }


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


def row(found: LinkDiagnosis) -> dict[str, Any]:
    """What was found, numbers rounded."""
    return {
        "links": {
            link.name: {
                "before": _rounded(found.before[link]),
                "after": _rounded(found.after[link]),
                "left": _rounded(found.unexplained[link].excess),
                "left_p_value": _rounded(found.unexplained[link].p_value),
                "more_left": found.unexplained[link].counts,
            }
            for link in found.links
        },
        "effects": [
            {
                "label": one.effect.label,
                "place": one.effect.effect.link,
                "family": one.effect.family,
                "level": one.level(),
                "parameters": [parameter.name for parameter in one.effect.parameters],
                "exact": one.exact,
                "gain": _rounded(one.gain),
                "share": _rounded(one.share),
                "left": _rounded(one.left),
                "p_value": _rounded(one.p_value),
                "rivals": [
                    [
                        rival.effect.label,
                        rival.effect.family,
                        _rounded(rival.worse.gain),
                        _rounded(rival.worse.p_value),
                    ]
                    for rival in one.rivals
                ],
            }
            for one in found.effects
        ],
        "sizes": {name: [size.value, [*size.interval95]] for name, size in found.sizes.items()},
    }


def _rounded(value: float) -> float:
    return float(f"{value:.4g}") if np.isfinite(value) else value


def main() -> None:
    """Run what is left, count, write."""
    parser = study_parser(__doc__)
    parser.add_argument("--cases", type=Path, default=CASES)
    parser.add_argument("--repeats", type=int, choices=(1, 2, 3), default=3)
    parser.add_argument("--from", dest="begin", type=int, default=1, help="number of first case")
    parser.add_argument("--to", type=int, help="number of the last case; all if left out")
    parser.add_argument("--tier", default="", help="only cases of this tier")
    parser.add_argument("--log", default=LOG, help="input of a single log")
    parser.add_argument("--seconds", type=float, default=LOG_DURATION, help="of a single log")
    parser.add_argument("--threads", type=int, default=1, help="of each case")
    options = parser.parse_args()
    if not options.cases.is_file():
        parser.error(f"no {options.cases}: draw it by scripts/link_study_cases.py, or give --cases")
    code = ("pamsim", "tests.plant", "link_study_cases")
    mark = fingerprint(code, __file__, options.cases)
    some = read(options.cases)["cases"][options.begin - 1 : options.to]
    chosen = [c for c in some if options.tier in ("", c["tier"])]
    log = f"{options.log} {options.seconds:g}"
    kind = f"{options.repeats} {options.threads} {log} {options.cases}"
    tasks = [(kind, case["name"], case["seed"]) for case in chosen]
    ends = f"{options.begin}_to_{options.begin + len(some) - 1}{options.tier}"
    ends += f"_{options.log}_{options.seconds:g}_s" * (options.repeats == 1)
    folder = KEPT / f"{options.cases.stem}_{options.repeats}_repeats_{options.threads}_{ends}"
    rows = kept_rows(run_one, tasks, folder, mark, options.workers, stopped=options.stopped)
    done = [
        {**case, **rows[task]} for case, task in zip(chosen, tasks, strict=True) if task in rows
    ]
    result = {
        "schema": "pamsim-link-study/1",
        **head(command(options)),
        "cases": hashlib.sha256(options.cases.read_bytes()).hexdigest()[:16],
        "fingerprint": mark,
        "must_show": [
            *must_show(done),
            *(must_show_of_one_log(done) if options.repeats == 1 and done else ()),
        ],
        "rows": done,
    }
    write_rows(result, options.json, "\n".join(table({"these": result})))


def command(options: argparse.Namespace) -> str:
    """The command that makes the same rows."""
    parts = [
        "python scripts/link_study.py",
        f"--cases {options.cases}" * (options.cases != CASES),
        f"--repeats {options.repeats}",
        f"--from {options.begin}" * (options.begin > 1),
        f"--to {options.to}" * (options.to is not None),
        f"--tier {options.tier}" * bool(options.tier),
        f"--log {options.log} --seconds {options.seconds:g}" * (options.repeats == 1),
        f"--workers {options.workers} --threads {options.threads}" * (options.threads > 1),
    ]
    return " ".join(filter(None, parts))


if __name__ == "__main__":
    main()
