"""``pamsim rigs``: the rigs that come with pamsim."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click

from pamsim.cli.command import Command
from pamsim.cli.main import OK
from pamsim.cli.options import RIG, json_option
from pamsim.cli.output import save_json, show_card, show_list


@click.command(name="rigs", cls=Command)
@click.argument("name", type=RIG, required=False)
@json_option
def command(name: str | None, json_file: Path | None) -> int:
    """List the rigs that come with pamsim, or show NAME, one of them or a rig folder."""
    from pamsim.engine.rig_cards import rig_cards

    result = rig_cards(name)
    save_json(json_file, result)
    if name is None:
        show_list("rigs for --rig", [(card["name"], card["purpose"]) for card in result["rigs"]])
        click.echo(
            "`pamsim rigs NAME` shows joints, muscles and drives; `pamsim params --rig NAME`"
        )
    for card in result["rigs"] if name else ():
        drives = card["drives"]["muscles"] | card["drives"]["joints"]
        show_card(
            f"{card['name']}: {card['purpose']}" if card["purpose"] else card["name"],
            {
                **{f"joint {joint['name']}": _joint(joint) for joint in card["joints"]},
                **{f"muscle {muscle['name']}": _muscle(muscle) for muscle in card["muscles"]},
                "load": f"on body {card['load_body']}" if card["load_body"] else "none",
                **{f"drive {kind}": meaning for kind, meaning in drives.items()},
                "folder": card["folder"],
            },
        )
    return OK


def _joint(joint: dict[str, Any]) -> str:
    turns = joint["kind"] == "angle"
    if joint["range"] is None:
        return "turns without limits" if turns else "slides without limits"
    low, high = (math.degrees(end) if turns else 1e3 * end for end in joint["range"])
    return (
        f"{'turns' if turns else 'slides'} from {low:.4g} to {high:.4g} {'deg' if turns else 'mm'}"
    )


def _muscle(muscle: dict[str, Any]) -> str:
    hysteresis = muscle["hysteresis"] or "none"
    supply = 1e-3 * muscle["supply_pressure"]
    return f"force law {muscle['force']}, hysteresis {hysteresis}, 0 to {supply:g} kPa"
