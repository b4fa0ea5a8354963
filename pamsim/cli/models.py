"""``pamsim models``: the force laws and hysteresis operators."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pamsim.cli.command import Command
from pamsim.cli.main import OK
from pamsim.cli.options import RIG, completed, json_option, law_names
from pamsim.cli.output import save_json, show_card, show_list


@click.command(name="models", cls=Command)
@click.argument("name", required=False, shell_complete=completed(law_names))
@click.option("--rig", type=RIG, help="Also the laws of this rig's effects.py.")
@json_option
def command(name: str | None, rig: str | None, json_file: Path | None) -> int:
    """List all force laws and hysteresis operators, or show the one called NAME."""
    from pamsim.fitting.models import models

    result = models(name, rig)
    save_json(json_file, result)
    if name is None:
        show_list("force laws F(p, kappa); fit them with `pamsim fit`", _rows(result["force_laws"]))
        show_list("hysteresis operators", _rows(result["operators"]))
        click.echo("`pamsim models NAME` shows parameters, units, ranges and notes")
    for entry in (*result["force_laws"], *result["operators"]) if name else ():
        show_card(
            f"{entry['name']}: {entry['title']}",
            {
                "equation": entry["equation"],
                "source": entry["source"],
                **{p["name"]: _parameter(p) for p in entry["parameters"]},
                "of the braid": ", ".join(entry.get("braid", ())).replace("_", " "),
                "inverse p(F, kappa)": _yes(entry.get("inverse")),
                "rate-independent": _yes(entry.get("rate_independent")),
                "notes": entry["notes"],
            },
        )
    return OK


def _rows(entries: list[dict[str, Any]]) -> list[tuple[str, str]]:
    return [(e["name"], f"{e['title']} ({e['source']})\n{e['equation']}") for e in entries]


def _parameter(p: dict[str, Any]) -> str:
    default = "" if p["default"] is None else f", default {p['default']:g}"
    return f"{p['range']:24s} {p['doc']}{default}"


def _yes(value: bool | None) -> str:
    return "" if value is None else "yes" if value else "no"
