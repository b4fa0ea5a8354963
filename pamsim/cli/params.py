"""``pamsim params``: every parameter of a rig."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pamsim.cli.command import Command
from pamsim.cli.main import OK
from pamsim.cli.options import completed, json_option, parameter_names, rig_option
from pamsim.cli.output import save_json, show_card, show_list


@click.command(name="params", cls=Command)
@click.argument("name", required=False, shell_complete=completed(parameter_names))
@rig_option
@json_option
def command(name: str | None, rig: str, json_file: Path | None) -> int:
    """List the parameters of a rig with value, range and source, or show the one called NAME.

    The names are those that `pamsim calibrate --free` takes. Values are in the units of the rig's
    params.toml, or in SI where it does not state them; ranges are in SI.
    """
    from pamsim.engine.rig_cards import parameter_cards

    result = parameter_cards(name, rig)
    save_json(json_file, result)
    cards = result["parameters"]
    if name is None:
        rows = [(c["name"], f"{_value(c):24s} {c['range']:24s} {c['source']}") for c in cards]
        show_list(f"parameters of {result['rig']}", rows)
        click.echo(f"`pamsim params NAME --rig {rig}` shows meaning, intervals and notes")
    for card in cards if name else ():
        stated = card["stated"] or {}
        show_card(
            f"{card['name']}: {card['doc']}",
            {
                "value": _value(card),
                "range": card["range"],
                "source": card["source"],
                "95 % interval": _ends(stated, "interval95"),
                "fitted within": _ends(stated, "bounds"),
                "note": stated.get("note", ""),
            },
        )
    return OK


def _value(card: dict[str, Any]) -> str:
    shown = card["stated"] or card
    return f"{shown['value']:.6g}{_unit(shown)}"


def _ends(stated: dict[str, Any], key: str) -> str:
    if stated.get(key) is None:
        return ""
    low, high = stated[key]
    return f"{low:g} to {high:g}{_unit(stated)}"


def _unit(shown: dict[str, Any]) -> str:
    return "" if shown["unit"] == "1" else f" {shown['unit']}"
