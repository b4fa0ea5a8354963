"""``pamsim diagnose``: what a rig's simulation lacks, by recordings of the rig."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pamsim.cli.diagnose_rest import diagnose_table, is_table
from pamsim.cli.main import FINDING, OK
from pamsim.cli.output import progress_bar, save_json

_FINE = ("no_gap", "named")
_ROWS = 6  # of a table on the screen; the page has them all


@click.command(name="diagnose")
@click.argument("data", nargs=-1, required=True)
@click.option("--rig", help="Shipped rig or rig folder; the recordings' own if left out.")
@click.option("--effects", multiple=True, help="Effects to try: NAME,NAME; all if left out.")
@click.option("--ordinary", multiple=True, help="Parameters refitted with every effect: NAME,NAME.")
@click.option("--channels", default="angle,pressure,force", show_default=True, help="To compare.")
@click.option("--hold-out", multiple=True, help="Trials or protocols to judge by: NAME,NAME.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of everything random.")
@click.option("--threads", type=int, help="Simulations at a time; one per processor if left out.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for page, rig, fits so far.")
@click.option("--resume", is_flag=True, help="Go on with the interrupted diagnosis in --out.")
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="Write the result here.")
def command(
    data: tuple[str, ...],
    rig: str | None,
    effects: tuple[str, ...],
    ordinary: tuple[str, ...],
    channels: str,
    hold_out: tuple[str, ...],
    seed: int,
    threads: int | None,
    out: Path | None,
    resume: bool,
    json_file: Path | None,
) -> int:
    """Find where a rig's simulation and DATA disagree, name the missing effect, and add it.

    DATA are recording folders; each input should be repeated three times or more, and some kept to
    judge by (protocols whose name ends in _check, or --hold-out). Or DATA is one table of angles at
    rest; mas20 is the printed one, and its rig the arm by its published force map. Exit 0 if there
    is no gap or its cause is named, 1 if something is missing and not, or not only, what is named.
    """
    from pamsim.core.errors import InputError
    from pamsim.diagnosis.diagnose import ORDINARY, diagnose
    from pamsim.diagnosis.repaired_rig import check_folder, write_repaired_rig
    from pamsim.diagnosis.report import comparisons, diagnosis_dict
    from pamsim.effects.catalog import effect

    if len(data) == 1 and is_table(data[0]):
        return diagnose_table(
            data[0],
            rig=rig,
            effects=_listed(effects),
            ordinary=_listed(ordinary),
            seed=seed,
            threads=threads,
            out=out,
            json_file=json_file,
        )
    if resume and out is None:
        raise InputError("--resume needs --out: the folder of the interrupted diagnosis")
    if out is not None:
        check_folder(out, rig)
    tried = [effect(name).name for name in _listed(effects)]
    with progress_bar("model") as progress:
        try:
            report = diagnose(
                data,
                rig=rig,
                effects=tried,
                ordinary=_listed(ordinary) or ORDINARY,
                channels=_listed((channels,)),
                held_out=_listed(hold_out),
                seed=seed,
                threads=threads,
                progress=progress,
                out=out,
                resume=resume,
            )
        except KeyboardInterrupt:
            if out is not None:
                click.echo("nothing is lost: go on with the same command and --resume", err=True)
            raise
    result = diagnosis_dict(report)
    if out is not None:
        from pamsim.report.diagnose_page import write_diagnosis

        folder = write_repaired_rig(report, out, result["sentence"])
        result["repaired_rig"] = None if folder is None else str(folder)
        save_json(out / "diagnosis.json", result)
        write_diagnosis(result, comparisons(report), out)
    save_json(json_file, result)
    _print(result)
    if out is not None:
        told = result["repaired_rig"] or "not written, for no one repair follows from the verdict"
        click.echo(f"rig:  {told}")
        click.echo(f"page: {out / 'index.html'}")
    click.echo(result["sentence"])
    click.echo(f"verdict: {result['verdict']}")
    return OK if result["verdict"] in _FINE else FINDING


def _listed(texts: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(part.strip() for text in texts for part in text.split(",") if part.strip())


def _print(result: dict[str, Any]) -> None:
    for note in result["notes"]:
        click.echo(f"note: {note}")
    for name, why in result["skipped"].items():
        click.echo(f"not tried: {name}: {why}")
    click.echo("held-out root mean square     noise floor      before       after")
    for channel, gap in result["gap"].items():
        cells = [gap[key] for key in ("floor", "before", "after")]
        numbers = ["none" if cell is None else f"{cell['value']:.4g}" for cell in cells]
        click.echo(
            f"{channel + ' [' + gap['unit'] + ']':28s}{numbers[0]:>13s}{numbers[1]:>12s}"
            f"{numbers[2]:>12s}"
        )
    _print_models("effect", result["effects"])
    _print_models("alternative", result["alternatives"][:_ROWS])
    following = result["next_experiment"]
    if following is not None:
        click.echo(f"next experiment: {following['protocol']}; {following['advice']}")


def _print_models(title: str, models: list[dict[str, Any]]) -> None:
    if not models:
        return
    rows = [(m, name, p) for m in models for name, p in m["parameters"].items()]
    width = max(len(title), *(len(m["name"]) for m in models))
    wide = max(len(name) for _, name, _ in rows)
    click.echo(f"{title:{width}s} explains  {'parameter':{wide}s}       value  95 % interval")
    before = None
    for model, name, p in rows:
        share = model["explained"]
        first = model is not before
        ends = p["interval95"]
        told = "none" if ends is None else f"[{ends[0]:.4g}, {ends[1]:.4g}]"
        unit = "" if p["unit"] == "1" else f" {p['unit']}"
        click.echo(
            f"{model['name'] if first else '':{width}s}"
            f"{'' if not first else 'none' if share is None else f'{100 * share:.0f} %':>9s}"
            f"  {name:{wide}s}{p['value']:12.5g}  {told}{unit}"
        )
        before = model
