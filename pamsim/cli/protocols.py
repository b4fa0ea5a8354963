"""``pamsim protocols``: the inputs of synthetic recordings."""

from __future__ import annotations

from pathlib import Path

import click

from pamsim.cli.command import Command
from pamsim.cli.main import OK
from pamsim.cli.options import completed, json_option, protocol_names
from pamsim.cli.output import save_json, show_card, show_list


@click.command(name="protocols", cls=Command)
@click.argument("name", required=False, shell_complete=completed(protocol_names))
@json_option
def command(name: str | None, json_file: Path | None) -> int:
    """List the inputs that `pamsim hide --protocols` takes, or show the one called NAME."""
    from pamsim.twins.protocol_cards import KINDS, protocol_cards

    result = protocol_cards(name)
    save_json(json_file, result)
    cards = result["protocols"]
    if name is None:
        for kind, meaning in KINDS.items():
            show_list(meaning, [(c["name"], c["shows"]) for c in cards if c["kind"] == kind])
        click.echo("`pamsim protocols NAME` shows what it commands, with which load, and how long")
    for card in cards if name else ():
        show_card(
            f"{card['name']}: {card['shows']}",
            {
                "group": KINDS[card["kind"]],
                "commands": card["commands"],
                "load": f"{card['load']:g} kg",
                "trial": f"{card['duration']:g} s at {card['rate']:g} Hz",
            },
        )
    return OK
