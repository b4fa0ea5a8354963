"""``pamsim sweep``: runs of a rig over varied parameters, inputs, effects and rigs."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import click

from pamsim.cli import options
from pamsim.cli.command import (
    Command,
    answer,
    exit_code,
    progress_bar,
    resumable,
    save_json,
    show_page,
)


@click.command(name="sweep", cls=Command)
@click.argument("study", type=options.PATH)
@options.resume("Continue the interrupted sweep in --out.")
@options.threads
@click.option("--processes", type=int, help="Worker processes instead of threads.")
@click.option("--trust-rig", is_flag=True, help="Run the effects.py of the study's rigs.")
@click.option("--scheduler", help="Address of a Dask scheduler, such as tcp://10.0.0.1:8786.")
@options.page("Folder for runs.parquet, sweep.json and page.", required=True)
def command(
    study: Path,
    out: Path,
    processes: int | None,
    scheduler: str | None,
    json_file: Path | None,
    **choices: Any,
) -> int:
    """Simulate, diagnose or calibrate a rig over everything that STUDY, a TOML file, varies.

    The table has a row for every run, failed ones included. An interrupted sweep goes on with
    --resume where it stopped. Exits with 1 if every run failed.
    """
    from pamsim.report.sweep_figure import write_sweep
    from pamsim.sweeps.sweep import sweep

    with _executor(processes, scheduler) as executor, progress_bar() as progress, resumable():
        result = sweep(study, out=out, executor=executor, progress=progress, **choices)
    written = [result.table, *result.save(out)]
    page = write_sweep(result, out)
    save_json(json_file, result.to_dict())
    for path in written:
        click.echo(f"wrote {path}")
    show_page(page)
    answer(result.summary())
    return exit_code(result.failed < result.runs)


@contextlib.contextmanager
def _executor(processes: int | None, scheduler: str | None) -> Iterator[Executor | None]:
    """Processes of this machine or the workers of a Dask scheduler; None without either."""
    from pamsim.core.errors import InputError

    if processes is not None and scheduler is not None:
        raise InputError("give `processes` or `scheduler`, not both")
    if scheduler is not None:
        try:
            from dask.distributed import Client  # pyright: ignore[reportMissingImports]
        except ImportError:
            raise InputError(
                "`scheduler` needs Dask: pip install distributed, here and on the workers"
            ) from None
        try:
            client = Client(scheduler, timeout="10s")
        except (OSError, ValueError, TypeError) as error:  # the last for TLS without certificates
            raise InputError(f"`scheduler`: no Dask scheduler at {scheduler}: {error}") from None
        with client:
            yield client.get_executor()
    elif processes is not None:
        import multiprocessing
        from concurrent.futures import ProcessPoolExecutor

        if processes < 1:
            raise InputError(f"`processes` is {processes}; give 1 or more")
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(processes, mp_context=context) as pool:
            yield pool
    else:
        yield None
