"""Rows of a study over many seeds: a sweep of a function, resumed as long as its code is as it was.

What `pamsim.sweep` keeps of a row here is one text, JSON, since rows of studies are nested.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from tqdm import tqdm

import pamsim
from pamsim.sweeps.sweep import finished_rows, is_begun

Task = tuple[str, str, int]
"""Kind, name and seed."""

Rows = dict[Task, dict[str, Any]]


def fingerprint(prefix: str | tuple[str, ...], *files: Path | str) -> str:
    """What the rows hang on: the code of the modules in use under names, and further files."""
    used = [m.__file__ for name, m in sys.modules.items() if name.startswith(prefix)]
    paths = sorted({str(path) for path in (*used, *files) if path})
    return hashlib.sha256(b"".join(Path(path).read_bytes() for path in paths)).hexdigest()[:16]


def as_text(row: Mapping[str, Any]) -> dict[str, str]:
    """What the function of a task returns."""
    return {"row": json.dumps(row)}


def kept_rows(
    run_one: Callable[[str, str, int], dict[str, str]],
    tasks: Sequence[Task],
    folder: Path,
    mark: str,
    workers: int,
    *,
    stopped: bool = False,
) -> Rows:
    """Rows of all tasks; those kept under the same fingerprint are not run again.

    Args:
        run_one: kind, name and seed to the row, by `as_text`; a function of a module, for it runs
            in a worker.
        tasks: to run.
        folder: of the sweep; one of other tasks, or of another fingerprint, is begun again.
        mark: see `fingerprint`.
        workers: processes.
        stopped: True to run nothing, and return what is there.
    """
    runs = [{"kind": kind, "name": name, "seed": seed} for kind, name, seed in tasks]
    study = pamsim.function_study(run_one, runs, columns={"row": "text"}, depends=mark)
    if not stopped:
        # The workers are the parallel part; threads inside each would only fight over the cores.
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        spawned = multiprocessing.get_context("spawn")
        with (
            ProcessPoolExecutor(workers, mp_context=spawned) as pool,
            tqdm(total=len(tasks), desc="rows") as bar,
        ):

            def shown(done: int, _total: int | None, _what: str) -> None:
                bar.update(done - bar.n)

            pamsim.sweep(
                study, out=folder, executor=pool, resume=is_begun(study, folder), progress=shown
            )
    return {
        (one["kind"], one["name"], int(one["seed"])): json.loads(one["row"])
        for one in finished_rows(study, folder)
    }
