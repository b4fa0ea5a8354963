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
    resume_option,
    threads_option,
)
from pamsim.cli.output import progress_bar, save_json, show_page

if TYPE_CHECKING:
    from pamsim.diagnosis.result import Diagnosis

_FINE = ("no_gap", "named")
_ROWS = 6  # of a table on the screen; the page has them all, and so has --verbose


@click.command(name="diagnose", cls=Command)
@click.argument("data", nargs=-1, required=True)
@click.option("--rig", type=RIG, help="Shipped rig or rig folder; the recordings' own if left out.")
@names_option("--effects", names=effect_names, help="Effects to try, all if left out")
@names_option("--without", names=effect_names, help="Effects not to try")
@names_option("--nuisance", names=parameter_names, help="Parameters refitted with every effect")
@names_option("--channels", help="Channels to compare, such as angle,pressure,force")
@names_option("--hold-out", help="Trials or protocols to judge by")
@click.option("--by-link", is_flag=True, help="Diagnose each link of the chain by itself.")
@click.option("--seed", type=int, default=0, show_default=True, help="Random seed.")
@threads_option
@out_option("Folder for page, JSON and rig.")
@resume_option("Continue the interrupted diagnosis in --out.")
@film_option
@open_option
@json_option
def command(
    data: tuple[str, ...],
    rig: str | None,
    effects: tuple[str, ...],
    without: tuple[str, ...],
    nuisance: tuple[str, ...],
    channels: tuple[str, ...],
    hold_out: tuple[str, ...],
    by_link: bool,
    seed: int,
    threads: int | None,
    out: Path | None,
    resume: bool,
    film: bool,
    json_file: Path | None,
) -> int:
    """Find where a simulation and DATA disagree, name the missing effect, and add it.

    DATA are recording folders, with each input repeated three times or more, and some held out
    (protocols whose name ends in _check, or --hold-out). Or DATA is one table of angles at rest: a
    CSV, or mas20 for the printed one. Or DATA is one length-pressure loop: a CSV, or alraouf2025
    for the printed one. Exit 0 if there is no gap or its cause is named, 1 if the cause is unknown
    or only partly identified.

    With --by-link every link that measured signals separate is simulated with its measured inputs,
    and each of several causes is named as deep as it holds. It takes some minutes, and writes no
    page.
    """
    from pamsim.core.errors import InputError
    from pamsim.diagnosis.diagnose import Kind, diagnose, kind_of
    from pamsim.diagnosis.repaired_rig import check_folder

    kind = kind_of(data)
    if by_link:
        given = {"channels": channels, "out": out, "resume": resume, "film": film}
        for name, one in given.items():
            if one:
                raise InputError(f"`{name}` does not apply to `by_link`; leave it out")
        if kind is not Kind.RECORDINGS:
            raise InputError(f"`by_link` does not apply to {kind}; leave it out")
        return _by_link(data, rig, effects, without, nuisance, hold_out, seed, threads, json_file)
    if resume and out is None:
        raise InputError("`resume` needs `out`: the folder of the interrupted diagnosis")
    if film and (out is None or kind is not Kind.RECORDINGS):
        raise InputError("`film` needs recordings, and `out` for the page that shows it")
    if out is not None:
        check_folder(out, rig)
    with progress_bar("model") as progress:
        try:
            report = diagnose(
                data,
                rig=rig,
                effects=effects,
                without=without,
                nuisance=nuisance,
                channels=channels,
                hold_out=hold_out,
                seed=seed,
                threads=threads,
                out=out,
                resume=resume,
                progress=progress,
            )
        except KeyboardInterrupt:
            if out is not None and kind is Kind.RECORDINGS:
                click.echo("fits are kept: continue with the same command and --resume", err=True)
            raise
    filmed = data[0] if film else None
    return show(report, out, json_file, repaired=kind is Kind.RECORDINGS, film=filmed, rig=rig)


def _by_link(
    data: tuple[str, ...],
    rig: str | None,
    effects: tuple[str, ...],
    without: tuple[str, ...],
    nuisance: tuple[str, ...],
    hold_out: tuple[str, ...],
    seed: int,
    threads: int | None,
    json_file: Path | None,
) -> int:
    from pamsim.core.encoding import to_dict
    from pamsim.diagnosis.by_link.recordings import diagnose_by_link
    from pamsim.diagnosis.recordings import NUISANCE

    with progress_bar("fit") as progress:
        report = diagnose_by_link(
            data,
            rig=rig,
            effects=effects,
            without=without,
            nuisance=nuisance or NUISANCE,
            hold_out=hold_out,
            seed=seed,
            threads=threads,
            progress=progress,
        )
    save_json(json_file, to_dict(report))
    for line in report.lines():
        click.echo(line)
    answer(f"verdict: {report.verdict}")
    return OK if report.verdict in _FINE else FINDING


def show(
    report: Diagnosis,
    out: Path | None,
    json_file: Path | None,
    *,
    repaired: bool,
    film: Path | str | None = None,
    rig: str | None = None,
) -> int:
    """Write a diagnosis and its page, and print it.

    Args:
        report: what was found.
        out: folder for page, JSON and rig, or None.
        json_file: for the result alone, or None.
        repaired: whether a repaired rig may have been written.
        film: recording whose rig is filmed, or None.
        rig: instead of the one that the recording names.

    Returns:
        The exit code.
    """
    from pamsim.core.encoding import read_json
    from pamsim.diagnosis.result import FILE, SCHEMA

    if out is None:
        result = report.to_dict()
    else:
        from pamsim.report.diagnose_page import write_diagnosis

        report.save(out)
        result = read_json(out / FILE, SCHEMA)
        filmed = None if film is None else _filmed(report, result, out, film, rig)
        write_diagnosis(result, report.comparisons, out, film=filmed)
    save_json(json_file, result)
    _print(result)
    if out is not None:
        if repaired:
            none = "no repaired rig written: no single cause identified"
            click.echo(f"rig:  {result['repaired_rig'] or none}")
        show_page(out / "index.html")
    answer(result["sentence"], f"verdict: {result['verdict']}")
    return OK if result["verdict"] in _FINE else FINDING


def _filmed(
    report: Diagnosis, result: dict[str, Any], out: Path, recording: Path | str, rig: str | None
) -> Path | None:
    """Film the trial with the largest gap; the diagnosis stands if it cannot be filmed."""
    from pamsim.core.errors import PamsimError
    from pamsim.engine.rig import load_rig
    from pamsim.recordings.recording_reader import read_recordings
    from pamsim.report.diagnose_page import shown_trials
    from pamsim.report.gap_film import film_gap

    path = out / "gap.gif"
    shown = shown_trials(result, report.comparisons)
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
