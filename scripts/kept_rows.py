"""Rows of a study over many seeds: run in parallel, kept line by line, run once when resumed."""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from tqdm import tqdm

Task = tuple[str, str, int]
"""Kind, name and seed."""

Rows = dict[Task, dict[str, Any]]


def fingerprint(prefix: str, *files: Path | str) -> str:
    """What the rows hang on: the code of the modules in use under a name, and further files."""
    used = [m.__file__ for name, m in sys.modules.items() if name.startswith(prefix)]
    paths = sorted({str(path) for path in (*used, *files) if path})
    return hashlib.sha256(b"".join(Path(path).read_bytes() for path in paths)).hexdigest()[:16]


def kept_rows(
    run_one: Callable[[Task], tuple[str, str, int, dict[str, Any]]],
    tasks: Sequence[Task],
    kept: Path,
    mark: str,
    workers: int,
) -> Rows:
    """Rows of all tasks; those kept under the same fingerprint are not run again.

    Args:
        run_one: task to itself and its row; a function of a module, for it runs in a worker.
        tasks: to run.
        kept: file of one JSON line per row; lines of other fingerprints are passed over.
        mark: see `fingerprint`.
        workers: processes.
    """
    rows: Rows = {}
    if kept.exists():
        for line in kept.read_text(encoding="utf-8").splitlines():
            page = json.loads(line)
            if page["fingerprint"] == mark:
                rows[page["kind"], page["name"], page["seed"]] = page["row"]
    left = [task for task in tasks if task not in rows]
    kept.parent.mkdir(parents=True, exist_ok=True)
    # The workers are the parallel part; threads inside each would only fight over the cores.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    spawned = multiprocessing.get_context("spawn")
    with (
        ProcessPoolExecutor(workers, mp_context=spawned) as pool,
        kept.open("a", encoding="utf-8") as file,
    ):
        for kind, name, seed, row in tqdm(pool.map(run_one, left), total=len(left), desc="rows"):
            rows[kind, name, seed] = row
            page = {"fingerprint": mark, "kind": kind, "name": name, "seed": seed, "row": row}
            file.write(json.dumps(page) + "\n")
            file.flush()
    return rows
