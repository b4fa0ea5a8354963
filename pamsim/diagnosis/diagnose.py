"""Diagnose: find where simulation and data disagree, and name the effect that is missing."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from enum import StrEnum
from pathlib import Path

from pamsim.comparison.loop_simulator import Loop
from pamsim.comparison.measurements import read_calibration_data
from pamsim.core.computation import Progress, one_blas_thread
from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link.limits import ALPHA, MATERIAL
from pamsim.diagnosis.by_link.result import LinkReport
from pamsim.diagnosis.length_pressure_loop import (
    PRINTED_LOOPS,
    diagnose_length_loop,
    printed_loop,
)
from pamsim.diagnosis.options import AS_USUAL, Options
from pamsim.diagnosis.recordings import diagnose_recordings
from pamsim.diagnosis.table_at_rest import diagnose_table, published_rig
from pamsim.engine.rig import Rig, given_or_recorded
from pamsim.recordings.measured_table import LengthLoop, read_measured
from pamsim.recordings.static_table import PRINTED as PRINTED_TABLE
from pamsim.recordings.static_table import read_static_table
from pamsim.recordings.table_reader import read_columns

Source = str | os.PathLike[str]


class Kind(StrEnum):
    """Kinds of data."""

    RECORDINGS = "recordings"
    TABLE = "a table of angles at rest"
    LOOP = "a length-pressure loop"


APPLIES: dict[str, Collection[Kind]] = {
    "rig": (Kind.RECORDINGS, Kind.TABLE),
    "without": (Kind.RECORDINGS,),
    "nuisance": (Kind.RECORDINGS, Kind.TABLE),
    "hold_out": (Kind.RECORDINGS,),
    "material": (Kind.RECORDINGS,),
    "learn": (Kind.RECORDINGS,),
    "threads": (Kind.RECORDINGS, Kind.TABLE),
}
"""Argument of `diagnose` -> kinds of data that it applies to; those not here apply to all."""


@one_blas_thread()
def diagnose(
    data: Source | Sequence[Source],
    *,
    rig: Source | Rig | None = None,
    effects: Sequence[str] = (),
    without: Sequence[str] = (),
    nuisance: Sequence[str] = (),
    hold_out: Sequence[str] = (),
    alpha: float = ALPHA,
    material: float = MATERIAL,
    learn: bool = True,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> LinkReport:
    """Diagnose recordings of a rig, a table of angles at rest, or a length-pressure loop.

    Args:
        data: recording folders; or the CSV of one table of angles at rest, ``mas20`` for the
            printed one; or the CSV of one length-pressure loop, ``alraouf2025`` for the printed
            means, ``alraouf2025_equations`` for the printed branches.
        rig: name or folder of the rig, or a loaded one. If left out, the recordings' own; for a
            table the MAS-20 arm by its published force map (``published``).
        effects: names of those that may be missing; if left out, all that the data can show.
        without: names of those that are not tried, such as what is known not to be missing.
        nuisance: parameters that are refitted with every effect, which must do better; if left out,
            `pamsim.diagnosis.options.usual_nuisance` or `pamsim.diagnosis.table_at_rest.NUISANCE`.
        hold_out: trials or protocols to judge by; see
            `pamsim.diagnosis.by_link.judged_units.held_out_split`.
        alpha: level of all tests: how often an effect that is not there may be claimed. Intervals
            stay those of 95 %.
        material: fall of a link's mean square below which no effect is reported [variance of the
            noise]; of rows at rest it is what noise does once in ``1 / alpha``.
        learn: whether curves are learned of what no effect explains.
        seed: random seed.
        threads: simulations at a time; None for one per processor.
        progress: called as each model is fitted; how many there will be is an estimate.

    Raises:
        InputError: for data that cannot be read, an argument that does not apply to them, or a name
            that is not known.
    """
    sources = [data] if isinstance(data, str | os.PathLike) else list(data)
    kind = kind_of(sources)
    options = Options(
        effects=tuple(effects),
        without=tuple(without),
        nuisance=tuple(nuisance),
        hold_out=tuple(hold_out),
        alpha=alpha,
        material=material,
        learn=learn,
        seed=seed,
        threads=threads,
        progress=progress,
    )
    chosen, usual = {**vars(options), "rig": rig}, {**vars(AS_USUAL), "rig": None}
    for name, kinds in APPLIES.items():
        if chosen[name] != usual[name] and kind not in kinds:
            raise InputError(f"`{name}` does not apply to {kind}; leave it out")
    if kind is Kind.LOOP:
        return _diagnose_loop(str(sources[0]), options)
    if kind is Kind.TABLE:
        own = published_rig() if rig in (None, "published") else given_or_recorded(rig, "mas20_arm")
        return diagnose_table(read_static_table(sources[0]), own, options)
    measured = read_calibration_data(sources)
    if measured.tables:
        raise InputError("give recordings alone, or one table of angles at rest alone")
    own = given_or_recorded(rig, measured.rig or "mas20_arm")
    return diagnose_recordings(measured, own, options)


def kind_of(sources: Sequence[Source]) -> Kind:
    """Kind of the data, by what the sources are.

    Raises:
        InputError: for a CSV that cannot be read.
    """
    if len(sources) != 1:
        return Kind.RECORDINGS
    name, path = str(sources[0]), Path(sources[0])
    if not path.exists() and name in PRINTED_LOOPS:
        return Kind.LOOP
    if not path.exists() and name == PRINTED_TABLE:
        return Kind.TABLE
    if path.suffix.lower() != ".csv" or not path.exists():  # of what is not there errors say more
        return Kind.RECORDINGS
    # A table of angles has no column of lengths.
    has_length = any(name.lower().startswith("length") for name in read_columns(path).cells)
    return Kind.LOOP if has_length else Kind.TABLE


def _diagnose_loop(source: str, options: Options) -> LinkReport:
    if not Path(source).exists():
        return diagnose_length_loop(printed_loop(source), PRINTED_LOOPS[source], options)
    table = read_measured(Path(source))
    if not isinstance(table, LengthLoop):
        raise InputError(
            f"{source} is not a length-pressure loop: it needs a pressure and a length"
        )
    loop = Loop(pressure=table.pressure, length=table.length, rising=table.rising)
    return diagnose_length_loop(loop, Path(source).name, options, warnings=table.notes)
