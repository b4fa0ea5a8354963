"""``pamsim diagnose``: what a simulation is missing, by recordings, a table at rest or a loop."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, answer, exit_code, progress_bar, save_json, show_page, warn
from pamsim.diagnosis.by_link.limits import ALPHA, MATERIAL

if TYPE_CHECKING:
    from pamsim.diagnosis.by_link.result import LinkReport
    from pamsim.report.link_page import Hidden

_FINE = ("no_gap", "named")


@click.command(name="diagnose", cls=Command)
@click.argument("data", nargs=-1, required=True)
@options.recorded_rig
@options.names("--effects", names=options.effect_names, help="Effects to try, all if left out")
@options.names("--without", names=options.effect_names, help="Effects not to try")
@options.names(
    "--nuisance", names=options.parameter_names, help="Parameters refitted with every effect"
)
@options.names("--hold-out", help="Trials or protocols to judge by")
@click.option(
    "--alpha",
    type=float,
    default=ALPHA,
    help="Level of all tests: how often an effect that is not there may be claimed.",
)
@click.option(
    "--material",
    type=float,
    default=MATERIAL,
    help="Fall of a link's mean square below which no effect is reported, in variances of the"
    " noise.",
)
@click.option(
    "--learn/--no-learn",
    default=True,
    help="Whether curves are learned of what no effect explains.",
)
@options.seed()
@options.threads
@options.film
@options.page("Folder for page, JSON and rig.")
def command(
    data: tuple[str, ...],
    rig: str | None,
    out: Path | None,
    film: bool,
    json_file: Path | None,
    **choices: Any,
) -> int:
    """Find where a simulation and DATA disagree, name the missing effects, and add them.

    DATA are recording folders, with each input repeated three times or more, and some held out
    (protocols whose name ends in _check, or --hold-out). Every link of the chain that measured
    signals separate is simulated with its measured inputs, and each cause is named as deep as it
    holds: place, family, effect, formula. Or DATA is one table of angles at rest: a CSV, or mas20
    for the printed one. Or DATA is one length-pressure loop: a CSV, or alraouf2025 for the printed
    one. Exit 0 if there is no gap or every cause is named, 1 if not.
    """
    from pamsim.core.errors import InputError
    from pamsim.diagnosis.diagnose import Kind, diagnose, kind_of
    from pamsim.diagnosis.fitted_rig import check_folder

    kind = kind_of(data)
    if film and (out is None or kind is not Kind.RECORDINGS):
        raise InputError("`film` needs recordings, and `out` for the page that shows it")
    if out is not None:
        check_folder(out, rig)
    with progress_bar("fit") as progress:
        report = diagnose(data, rig=rig, progress=progress, **choices)
    return show(report, out, json_file, film=data[0] if film else None, rig=rig)


def show(
    report: LinkReport,
    out: Path | None,
    json_file: Path | None,
    *,
    film: Path | str | None = None,
    rig: str | None = None,
    hidden: Hidden | None = None,
) -> int:
    """Write a diagnosis and its page, and print it; return the exit code.

    ``film`` is the recording whose rig is filmed, ``rig`` the one to use instead; for ``hidden``
    see `pamsim.report.link_page.write_link_diagnosis`.
    """
    from pamsim.core.encoding import read_json
    from pamsim.diagnosis.by_link.result import FILE, SCHEMA

    result = report.to_dict()
    if out is not None:
        from pamsim.report.link_page import write_link_diagnosis

        report.save(out)
        result = read_json(out / FILE, SCHEMA)
        filmed = None if film is None else _filmed(report, out, film, rig)
        write_link_diagnosis(result, report.comparisons, out, film=filmed, hidden=hidden)
    save_json(json_file, result)
    for warning in report.warnings:
        warn(warning)
    for line in report.lines():
        click.echo(line)
    if out is not None:
        if not report.at_rest:
            click.echo(f"rig:  {result['repaired_rig'] or 'none written: no effect was found'}")
        show_page(out / "index.html")
    answer(result["sentence"], f"verdict: {result['verdict']}")
    return exit_code(result["verdict"] in _FINE)


def _filmed(report: LinkReport, out: Path, recording: Path | str, rig: str | None) -> Path | None:
    """Film the trial with the largest gap; the diagnosis stands if it cannot be filmed."""
    from pamsim.core.errors import PamsimError
    from pamsim.engine.rig import load_rig
    from pamsim.recordings.recording_reader import read_recordings
    from pamsim.report.film import film_gap
    from pamsim.report.link_page import shown_trials

    path = out / "gap.gif"
    shown = shown_trials(report.to_dict(), report.comparisons)
    try:
        scene = load_rig(rig or read_recordings(recording).rig, scene=True)
        parts = [part for part in report.comparisons if part.trial in shown[:1]]
        with progress_bar("frame") as progress:
            film_gap(path, scene, parts, progress=progress)
    except PamsimError as error:
        warn(f"no film: {error}")
        return None
    return path
