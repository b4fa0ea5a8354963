"""``pamsim effects``: what a diagnosis can name."""

from __future__ import annotations

from pathlib import Path

import click

from pamsim.cli.main import OK
from pamsim.cli.options import RIG, json_option
from pamsim.cli.output import save_json


@click.command(name="effects")
@click.argument("name", required=False)
@click.option("--rig", type=RIG, help="Also the effects of this rig, and what it cannot have.")
@json_option
def command(name: str | None, rig: str | None, json_file: Path | None) -> int:
    """List the effects that a diagnosis can name, or show the one called NAME."""
    from pamsim.comparison.effect_cards import effect_cards

    result = effect_cards(name, rig)
    save_json(json_file, result)
    if name is not None:
        for card in result["effects"]:
            form = f" ({card['form']})" if card["form"] else ""
            click.echo(f"{card['name']}{form}: {card['missing']}")
            if card["equation"]:
                click.echo(f"  equation:     {card['equation']}")
            click.echo(f"  parameters:   {', '.join(card['parameters'])}")
            click.echo(f"  looks like:   {', '.join(card['look_alikes']) or 'nothing else'}")
            click.echo(f"  separated by: {card['separating']}")
            if card.get("places"):
                click.echo(f"  tried at:     {', '.join(card['places'])}")
            if card.get("not_tried"):
                click.echo(f"  not tried:    {card['not_tried']}")
        return OK
    family = ""
    for card in sorted(result["effects"], key=lambda card: card["family"]):
        if card["family"] != family:
            family = card["family"]
            click.echo(f"{family}:")
        label = f"{card['name']}:{card['form']}" if card["form"] else card["name"]
        note = f" [not on this rig: {card['not_tried']}]" if card.get("not_tried") else ""
        click.echo(f"  {label:34s} {card['missing']}{note}")
    click.echo("`pamsim effects NAME` shows parameters, look-alikes and the separating experiment")
    return OK
