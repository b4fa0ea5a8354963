"""A study: what is varied, by which design, and what is done in each run."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pamsim.core.computation import versions
from pamsim.core.errors import InputError, refuse_unknown
from pamsim.core.toml_tables import Entry, check_table, read_toml
from pamsim.engine.rig import rig_digest
from pamsim.recordings.rig_file import refuse_code
from pamsim.sweeps.design import Design, Factor, Runs, factor, runs_of
from pamsim.sweeps.examined import examine
from pamsim.sweeps.job import RIG, Job, loaded
from pamsim.sweeps.simulated import simulate_step

SCHEMA = "pamsim-sweep/1"
_COUNT = Entry(int, "a whole number, not below 0", 0, lambda count: count >= 0)
_STUDY = {
    "schema": Entry(write=f'"{SCHEMA}"', holds=lambda schema: schema == SCHEMA),
    "rig": Entry(write='"...", the name of a shipped rig, or a rig folder', default="mas20_arm"),
    "job": Entry(default="simulate"),
    "design": Entry(default=Design.GRID.value),
    "runs": _COUNT,
    "seed": _COUNT,
    "experiment": Entry(Mapping, "..., as a table [experiment]"),
    "vary": Entry(Mapping, "..., as tables [vary.NAME]"),
}
_JOBS = ("simulate", "diagnose", "calibrate")


@dataclass(frozen=True, kw_only=True)
class Study:
    """A sweep before it is run.

    Attributes:
        stated: as it was given, JSON-safe.
        factors: what varies.
        units: factor -> unit of its values; empty where they are text, such as names of rigs.
        design: how runs are chosen.
        base: ``runs`` as stated: the base sample of a sensitivity design.
        seed: of the draws.
        runs: factor -> value, of each run.
        job: what is done in each.
        fingerprint: of all that the rows depend on: study, contents of the rigs, versions.
    """

    stated: Mapping[str, Any]
    factors: tuple[Factor, ...]
    units: Mapping[str, str]
    design: Design
    base: int
    seed: int
    runs: Runs
    job: Job
    fingerprint: str


def read_study(
    source: str | os.PathLike[str] | Mapping[str, Any], *, trust_rig: bool = False
) -> Study:
    """Read and check a study.

    Args:
        source: TOML file, or the same as a mapping.
        trust_rig: whether to run the ``effects.py`` of a rig that a file names; a mapping is the
            caller's own.

    Raises:
        InputError: for what is not known or does not fit, with the key; for code that is not
            trusted.
    """
    if isinstance(source, Mapping):
        return _study(dict(source), trusted=True)
    path = Path(source)
    try:
        return _study(read_toml(path), trusted=trust_rig)
    except FileNotFoundError:
        raise InputError(f"no study {path}; give a TOML file") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _study(table: Mapping[str, Any], *, trusted: bool) -> Study:
    study = check_table(table, _STUDY, "study")
    what, rig, design = study["job"], study["rig"], study["design"]
    for name, known in (("job", _JOBS), ("design", [one.value for one in Design])):
        refuse_unknown(study[name], known, f"no {name} {study[name]!r}")
    factors = tuple(factor(str(name), own) for name, own in study["vary"].items())
    runs = runs_of(Design(design), factors, study["runs"], study["seed"])
    rigs = [str(name) for f in factors if f.name == RIG for name in f.values]
    units = {f.name: f.unit for f in factors if f.name != RIG}
    rigs_used = rigs or [rig]
    for name in () if trusted else rigs_used:
        refuse_code(name, "you trust the rigs of the study: give `trust_rig`")
    loaded_rigs = list(loaded(rigs_used).values())
    experiment, first = study["experiment"], loaded_rigs[0]
    job = (
        simulate_step(experiment, rig, first, units)
        if what == "simulate"
        else examine(what, experiment, rig, first, units)
    )
    content = [rig_digest(one) for one in loaded_rigs]
    stated = json.loads(json.dumps({"design": design, "rig": rig, **table}))
    text = json.dumps([stated, content, versions("scipy")], sort_keys=True)
    return Study(
        stated=stated,
        factors=factors,
        units={RIG: "", **job.units} if rigs else dict(job.units),
        design=Design(design),
        base=study["runs"],
        seed=study["seed"],
        runs=runs,
        job=job,
        fingerprint=hashlib.sha256(text.encode()).hexdigest(),
    )
