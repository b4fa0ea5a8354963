"""``pamsim diagnose`` of a table of angles at rest."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from pamsim.cli.main import FINDING, OK
from pamsim.cli.output import progress_bar, save_json

PRINTED = "mas20"
"""Stands for the printed angles at rest of the MAS-20 arm."""

PUBLISHED = "published"
"""Stands for the MAS-20 arm by its published force map alone."""


def is_table(source: str) -> bool:
    """Whether a source is a table of angles at rest, and no recording."""
    return (source == PRINTED and not Path(source).exists()) or source.lower().endswith(".csv")


def diagnose_table(
    source: str,
    *,
    rig: str | None,
    effects: Sequence[str],
    ordinary: Sequence[str],
    seed: int,
    threads: int | None,
    out: Path | None,
    json_file: Path | None,
) -> int:
    """Diagnose a rig by where it came to rest, print, and write what was asked for.

    Args:
        source: CSV, or ``mas20``.
        rig: name or folder; ``published`` or None for the MAS-20 arm by its published map alone.
        effects: to try; all that act at rest if empty.
        ordinary: refitted with every effect; the wheel's radius if empty.
        seed: of sign flips and exchanges.
        threads: simulations at a time.
        out: folder for figure and result.
        json_file: for the result.

    Returns:
        Exit code.
    """
    from pamsim.diagnosis.diagnose_rest import ORDINARY, diagnose_rest
    from pamsim.engine.rig import load_rig
    from pamsim.papers.published_rig import published_rig
    from pamsim.store.static_table import read_static_table

    base = published_rig() if rig in (None, PUBLISHED) else load_rig(str(rig))
    with progress_bar("model") as progress:
        report = diagnose_rest(
            read_static_table(source),
            base,
            effects=effects,
            ordinary=ordinary or ORDINARY,
            seed=seed,
            threads=threads,
            progress=progress,
        )
    result = report.as_dict()
    save_json(json_file, result)
    _print(result)
    if out is not None:
        from pamsim.report.diagnose_rest_figure import write_rest_figure

        out.mkdir(parents=True, exist_ok=True)
        save_json(out / "diagnosis.json", result)
        click.echo(f"figure: {write_rest_figure(result, out)}")
    click.echo(result["sentence"])
    click.echo(f"verdict: {result['verdict']}")
    return OK if result["verdict"] in ("no_gap", "named") else FINDING


def _print(result: dict[str, Any]) -> None:
    for note in result["notes"]:
        click.echo(f"note: {note}")
    width = max(len(t["name"]) for t in result["tried"]) if result["tried"] else 6
    click.echo(f"{'effect':{width}s}  left-out RMS   luck does as well")
    for one in sorted(result["tried"], key=lambda t: t["left_out_rms_deg"])[:8]:
        beside = f" beside {', '.join(one['beside'])}" if one["beside"] else ""
        click.echo(
            f"{one['name']:{width}s}  {one['left_out_rms_deg']:8.2f} deg"
            f"  {100.0 * one['p_value_luck']:15.2g} %{beside}"
        )
