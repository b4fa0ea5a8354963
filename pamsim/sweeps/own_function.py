"""A study of a function of one's own, such as a closed-loop experiment, run as a sweep."""

from __future__ import annotations

import functools
import hashlib
import inspect
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType
from typing import Any, TypeAlias

from pamsim.core.computation import versions
from pamsim.core.errors import InputError, PamsimError
from pamsim.core.limits import SWEEP_RUNS
from pamsim.core.reached_code import held
from pamsim.sweeps.design import Design, Factor, Value
from pamsim.sweeps.job import TEXTS, Job, Row
from pamsim.sweeps.run_table import INDEX
from pamsim.sweeps.study import Study

Function: TypeAlias = Callable[..., Mapping[str, float | str]]
"""Takes the factors of a run as keywords and returns its row."""


@dataclass(frozen=True, kw_only=True)
class OwnFunction(Job):
    """A function, of a module so that it can run in another process, that makes a run's row."""

    function: Function

    def rows(self, runs: Sequence[Mapping[str, Value]], threads: int | None) -> list[Row]:
        """One row per run, one after another; other columns than stated are an `InputError`."""
        return [self._row(run) for run in runs]

    def _row(self, run: Mapping[str, Value]) -> Row:
        try:
            found = self.function(**run)
        except PamsimError as error:
            return self.refused(error)
        given = {name: isinstance(one, str) for name, one in (found or {}).items()}
        stated = {name: unit == "text" for name, unit in self.outputs.items()}
        if given != stated:
            raise InputError(
                f"{_called(self.function)} returned {_listed(given) or 'nothing'}; `columns` states"
                f" {_listed(stated)}"
            )
        return {**found, "outcome": "completed", "message": ""}


def _listed(columns: Mapping[str, bool]) -> str:
    return ", ".join(f"{name} (text)" if text else name for name, text in sorted(columns.items()))


def function_study(
    function: Function,
    runs: Sequence[Mapping[str, Value]],
    *,
    columns: Mapping[str, str],
    units: Mapping[str, str] | None = None,
    depends: str = "",
    runs_in_block: int = 1,
) -> Study:
    """A study for `pamsim.sweeps.sweep.sweep` whose runs are calls of a function.

    A run in which the function raises a `PamsimError` is a row with the outcome ``refused``; any
    other exception ends the sweep, which keeps what is finished.

    Args:
        function: called with the values of a run as keywords; of a module, if an executor with
            processes runs it. It runs one call at a time in a process.
        runs: factor -> value, of each run; the same factors in all, each numbers or text.
        columns: what the function returns: name -> unit, ``text`` for text.
        units: factor -> unit, where it is a number that has one.
        depends: whatever else rows depend on, such as a digest of data. A sweep is resumed only if
            it, runs, columns, versions, the function's file and the numbers bound to the function,
            as by `functools.partial`, are as before.
        runs_in_block: calls that are worth a task of their own.

    Raises:
        InputError: for no runs or too many, runs of other factors, or a column with the name of a
            factor.
    """
    if not runs:
        raise InputError("`runs` is empty; give one mapping of factors to values or more")
    if len(runs) > SWEEP_RUNS:
        raise InputError(f"{len(runs):,} runs; a sweep has {SWEEP_RUNS:,} at most")
    names = list(runs[0])
    for i, run in enumerate(runs):
        if list(run) != names:
            raise InputError(
                f"runs[{i}] has the factors {', '.join(run)}; runs[0] has {', '.join(names)}"
            )
    taken = {INDEX, *names, *TEXTS} & set(columns)
    if taken:
        raise InputError(f"columns: {', '.join(sorted(taken))} is taken; choose other names")
    factors = tuple(Factor(name=n, unit="", values=tuple(run[n] for run in runs)) for n in names)
    for one in factors:
        if len({isinstance(value, str) for value in one.values}) > 1:
            raise InputError(f"runs: {one.name} is a number in some and text in others")
    is_text = {one.name: isinstance(one.values[0], str) for one in factors}
    given = units or {}
    stated = {"design": Design.ROWS.value, "job": _called(function), "columns": dict(columns)}
    content = [stated, [dict(run) for run in runs], depends, versions("scipy")]
    content = json.dumps(content, sort_keys=True, default=float)  # such as numpy's numbers
    digest = hashlib.sha256(content.encode())
    digest.update(_content(function))
    return Study(
        stated=stated,
        factors=factors,
        units={name: "" if text else given.get(name, "1") for name, text in is_text.items()},
        design=Design.ROWS,
        base=0,
        seed=0,
        runs=[dict(run) for run in runs],
        job=OwnFunction(function=function, outputs=dict(columns), runs_in_block=runs_in_block),
        fingerprint=digest.hexdigest(),
    )


def _called(function: Function) -> str:
    """Name of a function, with its module; of an object that can be called, that of its class."""
    own, _ = _unbound(function)
    named = own if hasattr(own, "__qualname__") else type(own)
    return f"{named.__module__}.{named.__qualname__}"


def _unbound(function: Any) -> tuple[Any, str]:
    """The function of partials, and the numbers bound to it: two of one text differ by them."""
    bound = ""
    while isinstance(function, functools.partial):
        bound += held([function.args, function.keywords])
        function = function.func
    own = inspect.unwrap(function)
    if isinstance(own, FunctionType):
        outside = inspect.getclosurevars(own).nonlocals
        bound += held([own.__defaults__, own.__kwdefaults__, dict(outside)])
    return own, bound


def _content(function: Function) -> bytes:
    """Numbers bound to a function, and the text that it is written in, if not in a session."""
    own, bound = _unbound(function)
    try:
        path = inspect.getsourcefile(own)
        text = b"" if path is None else Path(path).read_bytes()
    except (OSError, TypeError):
        text = b""
    return bound.encode() + text
