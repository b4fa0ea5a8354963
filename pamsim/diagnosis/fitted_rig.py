"""A rig with fitted parameters, and the repaired rig that is written with them.

The radius of all tendons' pulleys (sprockets) is one nuisance parameter of tables at rest.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pamsim.comparison.readable_unit import readable, readable_interval, readable_unit
from pamsim.core.errors import InputError
from pamsim.core.files import refuse_file
from pamsim.core.parameters import Sourced
from pamsim.engine.parameters import RigParameter, each_muscle, rig_parameter
from pamsim.engine.rig import Rig
from pamsim.recordings.rig_file import RigFile, find_rig
from pamsim.recordings.rig_writer import write_rig

PULLEY = "pulley radius"
"""Its name among fitted parameters."""

RIG_FOLDER = "rig"
_WIDTH = 98  # of the comment at the top of the file


def pulleys(rig: Rig) -> list[str]:
    """Names of the parameters that hold the radii of the tendons' pulleys."""
    return [n for n in rig.file.native if n.startswith("tendon.") and n.endswith(".coef")]


def stated(rig: Rig, name: str) -> RigParameter:
    """A parameter as a rig states it; of ``pulley radius``, the radius of its first pulley.

    Raises:
        InputError: for a name that the rig does not have, or if it states no pulley.
    """
    if name != PULLEY:
        return rig_parameter(rig, name)
    if not pulleys(rig):
        raise InputError(f"{rig.name} states no pulley (tendon.NAME.coef); leave out {PULLEY!r}")
    return rig_parameter(rig, pulleys(rig)[0])


def with_fitted(rig: Rig, values: Mapping[str, float]) -> Rig:
    """The rig with fitted parameters, name -> value [SI], `PULLEY` perhaps among them.

    Radii that differ keep their ratio, as do numbers in which muscles differ (`each_muscle`).

    Raises:
        ParameterError: for a value outside its range.
    """
    named = {name: value for name, value in values.items() if name != PULLEY}
    if PULLEY in values:
        radii = {name: rig_parameter(rig, name).value for name in pulleys(rig)}
        first = stated(rig, PULLEY).value
        named |= {name: values[PULLEY] * (radius / first) for name, radius in radii.items()}
    return rig.with_parameters(each_muscle(rig, named))


def possible_rig(rig: Rig, values: Mapping[str, float]) -> Rig | None:
    """As `with_fitted`; None where a value lies at an open end of its range."""
    try:
        return with_fitted(rig, values)
    except InputError:
        return None


@dataclass(frozen=True, kw_only=True)
class Repair:
    """What a repaired rig is written from."""

    rig: RigFile  # the rig that was diagnosed
    numbers: Mapping[str, Sourced]  # fitted parameter -> its entry in the unit of the rig's file
    origin: str  # names of the recordings


def check_folder(out: Path, rig: str | None) -> None:
    """Refuse, before the work begins, a folder that the repaired rig could not be written to.

    Raises:
        InputError: if the folder is a file, or the rig that is diagnosed, if given, is read from
            it.
    """
    refuse_file(out)
    if rig is None:
        return
    old, new = find_rig(rig).resolve(), (out / RIG_FOLDER).resolve()
    if new == old or old in new.parents:
        raise InputError(
            f"{out}: the repaired rig would lie in the folder of the rig it is made from; name"
            " another"
        )


def write_repaired_rig(repair: Repair, folder: Path, sentence: str) -> Path:
    """Write the rig that a diagnosis leads to, its verdict in words at the top of the file.

    Raises:
        InputError: if it cannot be written.
    """
    heading = (
        f"Written by pamsim diagnose from {repair.origin}.\n{textwrap.fill(sentence, _WIDTH)}\n"
        "Everything below without that source is as it was in the original rig."
    )
    write_rig(repair.rig, folder, repair.numbers, heading=heading)
    return folder


def repair(
    rig: Rig,
    values: Mapping[str, float],
    intervals: Mapping[str, tuple[float, float]],
    effect_of: Mapping[str, str],
    origin: str,
) -> Repair:
    """The repair of a rig without effects: all that was fitted, as entries of its file.

    Values and 95 % intervals are in SI; infinite ends are not written. Parameters without an effect
    in ``effect_of`` were refitted. ``origin`` names the recordings.
    """
    numbers: dict[str, Sourced] = {}
    known = {name: ends for name, ends in intervals.items() if all(map(math.isfinite, ends))}
    low, high = (each_muscle(rig, {n: of[end] for n, of in known.items()}) for end in (0, 1))
    for name, value in each_muscle(rig, values).items():
        before, shared = rig_parameter(rig, name), name.rpartition(":")[2]
        interval = (low[name], high[name]) if name in low else None
        numbers[name] = Sourced(
            value=readable(before, value),
            unit=readable_unit(before),
            source=f"identified by pamsim diagnose from {origin}",
            where=f"repaired {name}",
            interval95=readable_interval(before, interval),
            note=effect_of.get(name) or effect_of.get(shared, "refitted beside the named effects"),
        )
    return Repair(rig=rig.file, numbers=numbers, origin=origin)
