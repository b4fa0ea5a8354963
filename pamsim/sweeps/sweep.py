"""Run a study: in this process, or on any executor; keep every block of runs as it is finished."""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from pathlib import Path
from typing import Any

from pamsim.core.computation import Progress
from pamsim.core.encoding import CheckpointFile
from pamsim.core.errors import EngineError, InputError
from pamsim.sweeps.design import Value
from pamsim.sweeps.job import Job, Row
from pamsim.sweeps.result import SweepResult, result_of
from pamsim.sweeps.run_table import INDEX, RunTable
from pamsim.sweeps.study import Study, read_study

STUDY = "study.json"
"""In the folder of a sweep: what its rows are of."""

_WAITING = 64
"""Blocks handed to an executor at a time: enough for many workers, and memory stays flat."""

_MOST_BLOCKS = 20_000

_Runs = Sequence[Mapping[str, Value]]


def sweep(
    study: str | os.PathLike[str] | Mapping[str, Any] | Study,
    *,
    out: str | os.PathLike[str],
    executor: Executor | None = None,
    threads: int | None = None,
    resume: bool = False,
    trust_rig: bool = False,
    progress: Progress | None = None,
) -> SweepResult:
    """Run a study and write a table with a row for every run, failed ones included.

    Args:
        study: TOML file, the same as a mapping, or a `Study`.
        out: folder for ``runs.parquet`` and, until it is finished, what has been computed.
        executor: any of `concurrent.futures`, such as a process pool or Dask's
            ``Client.get_executor()``; this process with threads if left out. The rows are the same.
        threads: simulations at a time in this process; one per processor if left out.
        resume: go on with what an interrupted run left in ``out``: no finished block is run again.
        trust_rig: whether to run the ``effects.py`` of a rig that the file names.
        progress: called with the runs done and their number.

    Raises:
        InputError: for a study that cannot be run, less than one thread, or if ``resume`` finds
            another study in ``out``.
        EngineError: if a worker process ends; what is finished is kept.
    """
    began = time.perf_counter()
    plan = study if isinstance(study, Study) else read_study(study, trust_rig=trust_rig)
    if executor is not None and threads is not None:
        raise InputError(
            "`threads` and `executor` exclude each other, for an executor has workers of its own;"
            " leave one out"
        )
    if threads is not None and threads < 1:
        raise InputError(f"`threads` is {threads}; give 1 or more")
    folder, job, size = Path(out), plan.job, _runs_in_block(plan)
    blocks = [plan.runs[i : i + size] for i in range(0, len(plan.runs), size)]
    table = _table(plan, folder)
    done = _begun(plan, folder, table, len(blocks), resume=resume)
    kept = sum(len(blocks[block]) for block in done)
    left = [block for block in range(len(blocks)) if block not in done]
    finished, report = kept, progress or (lambda *_: None)
    report(finished, len(plan.runs), "runs")
    for block, rows in _computed(job, [(b, blocks[b]) for b in left], executor, threads):
        first = block * size
        table.add(
            block,
            [
                {INDEX: first + i, **run, **row}
                for i, (run, row) in enumerate(zip(blocks[block], rows, strict=True))
            ],
        )
        finished += len(rows)
        report(finished, len(plan.runs), "runs")
    if not table.is_finished(len(plan.runs)):
        table.finish(len(blocks))
    return result_of(plan, table.path, kept=kept, seconds=time.perf_counter() - began)


def is_begun(study: Study, out: str | os.PathLike[str]) -> bool:
    """Whether a folder holds a sweep of a study, which `sweep` can resume."""
    state = CheckpointFile(Path(out) / STUDY).load()
    return state is not None and state.get("fingerprint") == study.fingerprint


def finished_rows(study: Study, out: str | os.PathLike[str]) -> list[dict[str, Any]]:
    """What a sweep has so far, also while it runs elsewhere or after it was stopped.

    Args:
        study: of the sweep.
        out: its folder.

    Returns:
        A row for each run that is finished, in the order of the runs: column -> value, None for a
        number that the run did not come to; empty if the folder holds no sweep of the study.
    """
    if not is_begun(study, out):
        return []
    return _table(study, Path(out)).rows(-(-len(study.runs) // _runs_in_block(study)))


def _runs_in_block(plan: Study) -> int:
    return max(plan.job.runs_in_block, -(-len(plan.runs) // _MOST_BLOCKS))


def _table(plan: Study, folder: Path) -> RunTable:
    factors = {f.name: plan.units[f.name] or "text" for f in plan.factors}
    return RunTable(folder, {**factors, **plan.job.columns})


def _begun(plan: Study, folder: Path, table: RunTable, count: int, *, resume: bool) -> set[int]:
    """Blocks that are done; the folder then belongs to the study."""
    file = CheckpointFile(folder / STUDY)
    if not resume:
        table.clear()
        file.save({"fingerprint": plan.fingerprint, "study": plan.stated})
        return set()
    state = file.load()
    if state is None:
        raise InputError(f"`resume`: {folder} holds no sweep")
    if state.get("fingerprint") != plan.fingerprint:
        raise InputError(
            f"`resume`: {folder / STUDY} is of another study, rig or version; start without"
            " `resume`"
        )
    if table.is_finished(len(plan.runs)):
        return set(range(count))
    done = table.complete_blocks(count)
    table.clear(done)
    return done


def _computed(
    job: Job,
    tasks: Sequence[tuple[int, _Runs]],
    executor: Executor | None,
    threads: int | None,
) -> Iterator[tuple[int, list[Row]]]:
    """Number and rows of each block as it is finished."""
    if executor is None:
        for block, runs in tasks:
            yield block, job.rows(runs, threads)
        return
    waiting: dict[Future[list[Row]], int] = {}
    following = iter(tasks)
    try:
        while True:
            for block, runs in itertools.islice(following, _WAITING - len(waiting)):
                waiting[executor.submit(job.rows, runs, 1)] = block
            if not waiting:
                return
            finished, _ = wait(waiting, return_when=FIRST_COMPLETED)
            for future in finished:
                yield waiting.pop(future), future.result()
    except BrokenExecutor:
        raise EngineError(
            "a worker process ended before its runs were finished; what is finished is kept, go on"
            " with `resume`"
        ) from None
    finally:
        for future in waiting:
            future.cancel()
