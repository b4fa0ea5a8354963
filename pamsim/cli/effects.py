"""``pamsim effects``: what a diagnosis can name."""

from __future__ import annotations

from pathlib import Path

import click

from pamsim.cli.command import Command
from pamsim.cli.main import OK
from pamsim.cli.options import RIG, completed, effect_names, json_option
from pamsim.cli.output import save_json, show_card, show_list


@click.command(name="effects", cls=Command)
@click.argument("name", required=False, shell_complete=completed(effect_names))
@click.option("--rig", type=RIG, help="Also the effects of this rig, and what it cannot have.")
@json_option
def command(name: str | None, rig: str | None, json_file: Path | None) -> int:
    """List the effects that a diagnosis can name, or show the one called NAME."""
    from pamsim.comparison.effect_cards import effect_cards

    result = effect_cards(name, rig)
    save_json(json_file, result)
    cards = result["effects"]
    if name is None:
        for family in sorted({card["family"] for card in cards}):
            show_list(family, [_row(card) for card in cards if card["family"] == family])
        click.echo("`pamsim effects NAME` shows parameters, look-alikes and separating experiment")
        return OK
    for card in cards:
        form = f" ({card['form']})" if card["form"] else ""
        show_card(
            f"{card['name']}{form}: {card['missing']}",
            {
                "equation": card["equation"],
                "parameters": ", ".join(card["parameters"]),
                "looks like": ", ".join(card["look_alikes"]) or "nothing else",
                "separated by": card["separating"],
                "tried at": ", ".join(card.get("places", ())),
                "not tried": card.get("not_tried") or "",
            },
        )
    return OK


def _row(card: dict[str, str]) -> tuple[str, str]:
    note = f" [not on this rig: {card['not_tried']}]" if card.get("not_tried") else ""
    label = f"{card['name']}:{card['form']}" if card["form"] else card["name"]
    return label, f"{card['missing']}{note}"
