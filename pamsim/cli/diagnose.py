"""``pamsim diagnose``: what a simulation is missing, by recordings, a table at rest or a loop."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pamsim.cli.command import Command, answer, verbose, warn
from pamsim.cli.main import FINDING, OK
from pamsim.cli.options import (
    RIG,
    effect_names,
    film_option,
    json_option,
    names_option,
    open_option,
    out_option,
    parameter_names,
    threads_option,
)
from pamsim.cli.output import progress_bar, save_json, show_page

if TYPE_CHECKING:
    from pamsim.diagnosis.by_link.result import LinkReport
    from pamsim.diagnosis.result import Diagnosis

_FINE = ("no_gap", "named")
_ROWS = 6  # of a table on the screen; the page has them all, and so has --verbose


@click.command(name="diagnose", cls=Command)
@click.argument("data", nargs=-1, required=True)
@click.option("--rig", type=RIG, help="Shipped rig or rig folder; the recordings' own if left out.")
@names_option("--effects", names=effect_names, help="Effects to try, all if left out")
@names_option("--without", names=effect_names, help="Effects not to try")
@names_option("--nuisance", names=parameter_names, help="Parameters refitted with every effect")
@names_option("--hold-out", help="Trials or protocols to judge by")
@click.option("--seed", type=int, default=0, show_default=True, help="Random seed.")
@threads_option
@out_option("Folder for page, JSON and rig.")
@film_option
@open_option
@json_option
def command(
    data: tuple[str, ...],
    rig: str | None,
    effects: tuple[str, ...],
    without: tuple[str, ...],
    nuisance: tuple[str, ...],
    hold_out: tuple[str, ...],
    seed: int,
    threads: int | None,
    out: Path | None,
    film: bool,
    json_file: Path | None,
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
    from pamsim.diagnosis.repaired_rig import check_folder

    kind = kind_of(data)
    if film and (out is None or kind is not Kind.RECORDINGS):
        raise InputError("`film` needs recordings, and `out` for the page that shows it")
    if out is not None:
        check_folder(out, rig)
    with progress_bar("fit") as progress:
        report = diagnose(
            data,
            rig=rig,
            effects=effects,
            without=without,
            nuisance=nuisance,
            hold_out=hold_out,
            seed=seed,
            threads=threads,
            progress=progress,
        )
    return show(report, out, json_file, film=data[0] if film else None, rig=rig)


def show(
    report: LinkReport | Diagnosis,
    out: Path | None,
    json_file: Path | None,
    *,
    film: Path | str | None = None,
    rig: str | None = None,
) -> int:
    """Write a diagnosis and its page, and print it.

    Args:
        report: what was found.
        out: folder for page, JSON and rig, or None.
        json_file: for the result alone, or None.
        film: recording whose rig is filmed, or None.
        rig: instead of the one that the recording names.

    Returns:
        The exit code.
    """
    from pamsim.core.encoding import read_json
    from pamsim.diagnosis.by_link.result import FILE, SCHEMA, LinkReport
    from pamsim.diagnosis.result import SCHEMA as SCHEMA_AT_REST

    by_link = isinstance(report, LinkReport)
    if out is None:
        result = report.to_dict()
    else:
        report.save(out)
        result = read_json(out / FILE, SCHEMA if by_link else SCHEMA_AT_REST)
        if by_link:
            from pamsim.report.link_page import write_link_diagnosis

            filmed = None if film is None else _filmed(report, out, film, rig)
            write_link_diagnosis(result, report.comparisons, out, film=filmed)
        else:
            from pamsim.report.diagnose_page import write_diagnosis

            write_diagnosis(result, report.comparisons, out)
    save_json(json_file, result)
    if by_link:
        for warning in report.warnings:
            warn(warning)
        for line in report.lines():
            click.echo(line)
    else:
        _print(result)
    if out is not None:
        if by_link:
            click.echo(f"rig:  {result['repaired_rig'] or 'none written: no effect was found'}")
        show_page(out / "index.html")
    answer(result["sentence"], f"verdict: {result['verdict']}")
    return OK if result["verdict"] in _FINE else FINDING


def _filmed(report: LinkReport, out: Path, recording: Path | str, rig: str | None) -> Path | None:
    """Film the trial with the largest gap; the diagnosis stands if it cannot be filmed."""
    from pamsim.core.errors import PamsimError
    from pamsim.engine.rig import load_rig
    from pamsim.recordings.recording_reader import read_recordings
    from pamsim.report.gap_film import film_gap
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


def _print(result: dict[str, Any]) -> None:
    from pamsim.report.physical_words import physical_words

    for warning in result["warnings"]:
        warn(warning)
    for name, why in result["skipped"].items():
        click.echo(f"not tried: {name}: {why}")
    rows = {f"{channel} [{gap['unit']}]": gap for channel, gap in result["gap"].items()}
    width = max(28, *map(len, rows))
    click.echo(f"{'held-out RMS':{width}s}  noise floor      before       after")
    for row, gap in rows.items():
        cells = [gap[key] for key in ("floor", "before", "after")]
        numbers = ["none" if cell is None else f"{cell['value']:.4g}" for cell in cells]
        click.echo(f"{row:{width}s}{numbers[0]:>13s}{numbers[1]:>12s}{numbers[2]:>12s}")
    _print_models("effect", result["effects"])
    _print_models("alternative", result["alternatives"][: None if verbose() else _ROWS])
    for family, sizes in result["certain_families"].items():
        size = physical_words(sizes)
        click.echo(f"certain: {family.replace('_', ' ')}{': ' if size else ''}{size}")
    following = result["next_experiment"]
    if following is not None:
        protocol = "" if following["protocol"] is None else f"{following['protocol']}; "
        click.echo(f"next experiment: {protocol}{following['advice']}")


def _print_models(title: str, models: list[dict[str, Any]]) -> None:
    if not models:
        return
    rows = [(m, name, p) for m in models for name, p in m["parameters"].items()]
    width = max(len(title), *(len(m["name"]) for m in models))
    wide = max(len(name) for _, name, _ in rows)
    click.echo(f"{title:{width}s} explains  {'parameter':{wide}s}       value  95 % interval")
    previous = None
    for model, name, p in rows:
        share, first, ends = model["explained"], model is not previous, p["interval95"]
        interval = "none" if ends is None else f"[{ends[0]:.4g}, {ends[1]:.4g}]"
        unit = "" if p["unit"] == "1" else f" {p['unit']}"
        click.echo(
            f"{model['name'] if first else '':{width}s}"
            f"{'' if not first else 'none' if share is None else f'{100 * share:.0f} %':>9s}"
            f"  {name:{wide}s}{p['value']:12.5g}  {interval}{unit}"
        )
        previous = model
