"""What scripts share: options, noise, rows of many seeds, parts, shares, and records."""

from __future__ import annotations

import argparse
import functools
import hashlib
import json
import multiprocessing
import os
import platform
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from scipy.signal import lfilter
from scipy.stats import binomtest
from tqdm import tqdm

import pamsim
from pamsim.core.encoding import write_json
from pamsim.core.units import FloatArray
from pamsim.sweeps.sweep import finished_rows, is_begun

RESULTS = Path(__file__).parent / "results"

Task = tuple[str, str, int]
"""Kind, name and seed."""

Rows = dict[Task, dict[str, Any]]


def parser(
    description: str | None, target: Path | None = None, **options: float | str
) -> argparse.ArgumentParser:
    """A parser with ``--json FILE``, whose help is the docstring of a script.

    Args:
        description: the docstring.
        target: FILE, if it is left out.
        options: further ones -> their values if they are left out, which are of their types.
    """
    raw = argparse.RawDescriptionHelpFormatter
    made = argparse.ArgumentParser(description=description, formatter_class=raw)
    made.add_argument("--json", type=Path, default=target, metavar="FILE")
    for name, default in options.items():
        made.add_argument(f"--{name}", type=type(default), default=default)
    return made


def study_parser(
    description: str | None, target: Path | None = None, **options: float | str
) -> argparse.ArgumentParser:
    """The same for `kept_rows`, with ``--workers`` and ``--stopped``."""
    made = parser(description, target, **options, workers=2)
    made.add_argument("--stopped", action="store_true", help="count the finished rows only")
    return made


def fingerprint(prefix: str | tuple[str, ...], *files: Path | str) -> str:
    """What the rows hang on: the code of the modules in use under names, and further files."""
    used = [m.__file__ for name, m in sys.modules.items() if name.startswith(prefix)]
    paths = sorted({str(path) for path in (*used, *files) if path})
    return hashlib.sha256(b"".join(Path(path).read_bytes() for path in paths)).hexdigest()[:16]


def kept_rows(
    run_one: Callable[[str, str, int], dict[str, Any]],
    tasks: Sequence[Task],
    folder: Path,
    mark: str,
    workers: int,
    *,
    stopped: bool = False,
) -> Rows:
    """Rows of all tasks: a sweep of a function, resumed as long as its code is as it was.

    Args:
        run_one: kind, name and seed to the row, which JSON can hold; a function of a module, for it
            runs in a worker.
        tasks: to run.
        folder: of the sweep; one of other tasks, or of another fingerprint, is begun again.
        mark: see `fingerprint`.
        workers: processes.
        stopped: True to run nothing, and return what is there.

    Raises:
        SystemExit: for no tasks.
    """
    if not tasks:
        raise SystemExit("nothing to run: the options leave no case")
    runs = [{"kind": kind, "name": name, "seed": seed} for kind, name, seed in tasks]
    function = functools.partial(_as_text, run_one)
    study = pamsim.function_study(function, runs, columns={"row": "text"}, depends=mark)
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


def _as_text(run_one: Callable[..., dict[str, Any]], **task: Any) -> dict[str, str]:
    """A row as what a sweep can keep of one that is nested: a text."""
    return {"row": json.dumps(run_one(**task))}


def run_parts(
    path: Path | None,
    about: Mapping[str, Any],
    jobs: Mapping[str, Callable[[], Any]],
    only: str | None,
) -> dict[str, Any]:
    """Run the parts of a study that are asked for, and write its record after each.

    Args:
        path: of the record; what it holds of other parts stays.
        about: what begins the record.
        jobs: part -> what finds it.
        only: the part that is asked for; None for all.
    """
    record = {**read(path), **about}
    for part, job in jobs.items():
        if only in (None, part):
            record[part] = job()
            write(record, path)
    return record


def noise(
    rng: np.random.Generator, shape: tuple[int, ...], correlation: float, before: int
) -> FloatArray:
    """Noise of standard deviation 1 along the first axis: AR(1), or white.

    Args:
        rng: random numbers.
        shape: of the noise.
        correlation: its time [samples]; 0 for white noise.
        before: samples that are drawn and left out, so that it is stationary.
    """
    white = rng.standard_normal((before + shape[0], *shape[1:]))
    phi = np.exp(-1.0 / correlation) if correlation else 0.0
    return np.sqrt(1.0 - phi**2) * lfilter([1.0], [1.0, -phi], white, axis=0)[before:]


def share(hits: int, count: int) -> dict[str, Any]:
    """A share with its exact 95 % interval (Clopper and Pearson, Biometrika 26, 1934)."""
    ends = binomtest(int(hits), count).proportion_ci() if count else None
    return {
        "hits": int(hits),
        "count": count,
        "share": float(hits / count) if count else None,
        "interval95": [ends.low, ends.high] if ends else None,
    }


def median(values: Sequence[float]) -> float | None:
    """Median; None of nothing."""
    return float(np.median(values)) if values else None


def head(command: str) -> dict[str, Any]:
    """What begins a record: the command that made it, and its versions."""
    return {"command": command, "mujoco": mujoco.__version__, "python": platform.python_version()}


def read(path: Path | None) -> dict[str, Any]:
    """A record that is there; empty if none is."""
    if path is None or not path.is_file():
        return {}
    return json.loads(path.read_text(encoding="utf-8"))


def write(record: Mapping[str, Any], path: Path | None) -> None:
    """Write a record where this is asked for."""
    if path is not None:
        write_json(path, record)


def write_arrays(path: Path, arrays: Mapping[str, Any], digest: str) -> None:
    """Write arrays that other tools are given, with their fingerprint."""
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, digest=np.array(digest), **arrays)


def print_and_write(record: Mapping[str, Any], path: Path | None) -> None:
    """Print a record, and write it where this is asked for."""
    print(json.dumps(record, indent=1))
    write(record, path)


def write_rows(
    record: Mapping[str, Any], path: Path | None, text: str = "", rows: str = "rows"
) -> None:
    """The same of a record with many rows under a key: printed is a text, or what is no row."""
    first = json.dumps({key: value for key, value in record.items() if key != rows}, indent=1)
    print(text or first)
    if path is not None:
        lines = ",\n".join("  " + json.dumps(row) for row in record[rows])
        path.write_text(f'{first[:-2]},\n "{rows}": [\n{lines}\n ]\n}}\n', encoding="utf-8")
