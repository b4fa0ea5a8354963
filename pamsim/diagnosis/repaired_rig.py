"""The rig with what a diagnosis found put right: refitted numbers and the named effects' own."""

from __future__ import annotations

import textwrap
from pathlib import Path

from pamsim.comparison.readable_unit import readable, readable_unit
from pamsim.core.errors import InputError
from pamsim.core.parameters import Sourced
from pamsim.diagnosis.diagnose import DiagnosisReport
from pamsim.diagnosis.method.judge import Trialled
from pamsim.diagnosis.models_as_json import CLAIMING
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.store.rig_file import find_rig
from pamsim.store.rig_writer import write_rig

RIG_FOLDER = "rig"
_WIDTH = 98  # of the comment at the top of the file


def check_folder(out: Path, rig: str | None) -> None:
    """Refuse, before the work begins, a folder that the repaired rig could not be written to.

    Args:
        out: folder that is to get the rig's folder.
        rig: name or folder of the rig that is diagnosed, if it is given.

    Raises:
        InputError: if the folder is a file, or the rig is read from it.
    """
    if out.exists() and not out.is_dir():
        raise InputError(f"{out} is a file; name a folder to write into")
    if rig is None:
        return
    old, new = find_rig(rig).resolve(), (out / RIG_FOLDER).resolve()
    if new == old or old in new.parents:
        raise InputError(
            f"--out {out}: the repaired rig would lie in the folder of the rig it is made from;"
            " name another"
        )


def write_repaired_rig(report: DiagnosisReport, out: Path, sentence: str) -> Path | None:
    """Write the rig that a diagnosis leads to.

    Args:
        report: of the diagnosis.
        out: folder that gets the rig's folder.
        sentence: verdict in words, for the top of the rig's file.

    Returns:
        The rig's folder; None where the verdict names nothing, or not one thing.

    Raises:
        InputError: if it cannot be written.
    """
    best = report.found.named.best
    if best is None or report.found.named.verdict not in CLAIMING:
        return None
    folder = out / RIG_FOLDER
    origin = ", ".join(Path(source).name or source for source in report.data.sources)
    heading = (
        f"Written by pamsim diagnose from {origin}.\n{textwrap.fill(sentence, _WIDTH)}\n"
        "Everything below that does not say so is as it was in the rig it started from."
    )
    write_rig(report.rig.file, folder, repaired_numbers(report.rig, best, origin), heading=heading)
    return folder


def repaired_numbers(rig: Rig, best: Trialled, origin: str) -> dict[str, Sourced]:
    """All that was fitted, as entries of the rig's file.

    Args:
        rig: without effects.
        best: the claimed model.
        origin: names of the recordings.

    Returns:
        Name of every fitted parameter -> its entry, in the unit of the rig's file.
    """
    effect_of = {p.name: c.name for c in best.candidates for p in c.parameters}
    numbers: dict[str, Sourced] = {}
    for name, value in best.fit.values.items():
        before = rig_parameter(rig, name)
        known = best.intervals.get(name)
        numbers[name] = Sourced(
            value=readable(before, value),
            unit=readable_unit(before),
            source=f"identified by pamsim diagnose from {origin}",
            where=f"repaired {name}",
            interval95=None
            if known is None
            else (readable(before, known[0]), readable(before, known[1])),
            note=effect_of.get(name, "refitted beside the named effects"),
        )
    return numbers
