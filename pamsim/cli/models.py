"""``pamsim models``: the force laws and hysteresis operators."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pamsim.cli.main import OK
from pamsim.cli.options import RIG, json_option
from pamsim.cli.output import save_json


@click.command(name="models")
@click.argument("name", required=False)
@click.option("--rig", type=RIG, help="Also the laws of this rig's effects.py.")
@json_option
def command(name: str | None, rig: str | None, json_file: Path | None) -> int:
    """List all force laws and hysteresis operators, or show the one called NAME."""
    from pamsim.fitting.models import models

    result = models(name, rig)
    save_json(json_file, result)
    if name is None:
        _print_list("force laws F(p, kappa); fit them with `pamsim fit`", result["force_laws"])
        _print_list("hysteresis operators", result["operators"])
        click.echo("`pamsim models NAME` shows parameters, units, ranges and notes")
    else:
        for entry in (*result["force_laws"], *result["operators"]):
            _print_one(entry)
    return OK


def _print_list(title: str, entries: list[dict[str, Any]]) -> None:
    click.echo(f"{title}:")
    for entry in entries:
        click.echo(f"  {entry['name']:28s} {entry['title']} ({entry['source']})")
        click.echo(f"  {'':28s} {entry['equation']}")


def _print_one(entry: dict[str, Any]) -> None:
    click.echo(f"{entry['name']}: {entry['title']}")
    click.echo(f"  {entry['equation']}")
    click.echo(f"  source: {entry['source']}")
    for p in entry["parameters"]:
        default = "" if p["default"] is None else f", default {p['default']:g}"
        click.echo(f"  {p['name']:20s} {p['range']:24s} {p['doc']}{default}")
    if entry.get("braid"):
        click.echo(f"  also takes the braid's {', '.join(entry['braid'])}".replace("_", " "))
    if "inverse" in entry:
        click.echo(f"  inverse p(F, kappa): {'yes' if entry['inverse'] else 'no'}")
    if "rate_independent" in entry:
        click.echo(f"  rate-independent: {'yes' if entry['rate_independent'] else 'no'}")
    if entry["notes"]:
        click.echo(f"  {entry['notes']}")
