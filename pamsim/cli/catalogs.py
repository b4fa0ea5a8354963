"""``pamsim list``: rigs, parameters, laws, effects and inputs, as a table or one by one."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, save_json, show_card, show_list
from pamsim.cli.main import NamedGroup


@click.group(name="list", cls=NamedGroup)
def command() -> None:
    """List rigs, parameters, laws, effects or inputs; with a NAME, all about one of them."""


@command.command(name="rigs", cls=Command)
@click.argument("name", type=options.RIG, required=False)
@options.json
def _rigs(name: str | None, json_file: Path | None) -> None:
    """List the rigs that come with pamsim, or show NAME, one of them or a rig folder."""
    from pamsim.engine.rig_cards import rig_cards

    result = rig_cards(name)
    save_json(json_file, result)
    if name is None:
        show_list("rigs for --rig", [(card["name"], card["purpose"]) for card in result["rigs"]])
        click.echo(
            "`pamsim list rigs NAME` shows joints, muscles and drives;"
            " `pamsim list params --rig NAME` its parameters"
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


@command.command(name="params", cls=Command)
@click.argument("name", required=False, shell_complete=options.completed(options.parameter_names))
@options.rig
@options.json
def _params(name: str | None, rig: str, json_file: Path | None) -> None:
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
        click.echo(f"`pamsim list params NAME --rig {rig}` shows meaning, intervals and notes")
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


@command.command(name="models", cls=Command)
@click.argument("name", required=False, shell_complete=options.completed(options.law_names))
@options.laws_rig
@options.json
def _models(name: str | None, rig: str | None, json_file: Path | None) -> None:
    """List all force laws and hysteresis operators, or show the one called NAME."""
    from pamsim.fitting.models import models

    result = models(name, rig)
    save_json(json_file, result)
    if name is None:
        show_list("force laws F(p, kappa); fit them with `pamsim fit`", _laws(result["force_laws"]))
        show_list("hysteresis operators", _laws(result["operators"]))
        click.echo("`pamsim list models NAME` shows parameters, units, ranges and notes")
    for entry in (*result["force_laws"], *result["operators"]) if name else ():
        show_card(
            f"{entry['name']}: {entry['title']}",
            {
                "equation": entry["equation"],
                "source": entry["source"],
                **{p["name"]: _coefficient(p) for p in entry["parameters"]},
                "of the braid": ", ".join(entry.get("braid", ())).replace("_", " "),
                "inverse p(F, kappa)": _yes(entry.get("inverse")),
                "rate-independent": _yes(entry.get("rate_independent")),
                "notes": entry["notes"],
            },
        )


def _laws(entries: list[dict[str, Any]]) -> list[tuple[str, str]]:
    return [(e["name"], f"{e['title']} ({e['source']})\n{e['equation']}") for e in entries]


def _coefficient(p: dict[str, Any]) -> str:
    default = "" if p["default"] is None else f", default {p['default']:g}"
    return f"{p['range']:24s} {p['doc']}{default}"


def _yes(value: bool | None) -> str:
    return "" if value is None else "yes" if value else "no"


@command.command(name="effects", cls=Command)
@click.argument("name", required=False, shell_complete=options.completed(options.effect_names))
@click.option(
    "--rig", type=options.RIG, help="Also the effects of this rig, and what it cannot have."
)
@options.json
def _effects(name: str | None, rig: str | None, json_file: Path | None) -> None:
    """List the effects that a diagnosis can name, or show the one called NAME."""
    from pamsim.comparison.effects_on_rig import effect_cards

    result = effect_cards(name, rig)
    save_json(json_file, result)
    cards = result["effects"]
    if name is None:
        for family in sorted({card["family"] for card in cards}):
            show_list(family, [_effect(card) for card in cards if card["family"] == family])
        click.echo(
            "`pamsim list effects NAME` shows parameters, look-alikes and separating experiment"
        )
        return
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


def _effect(card: dict[str, str]) -> tuple[str, str]:
    note = f" [not on this rig: {card['not_tried']}]" if card.get("not_tried") else ""
    label = f"{card['name']}:{card['form']}" if card["form"] else card["name"]
    return label, f"{card['missing']}{note}"


@command.command(name="protocols", cls=Command)
@click.argument("name", required=False, shell_complete=options.completed(options.protocol_names))
@options.json
def _protocols(name: str | None, json_file: Path | None) -> None:
    """List the inputs that `pamsim hide --protocols` takes, or show the one called NAME."""
    from pamsim.twins.protocol_cards import KINDS, protocol_cards

    result = protocol_cards(name)
    save_json(json_file, result)
    cards = result["protocols"]
    if name is None:
        for kind, meaning in KINDS.items():
            show_list(meaning, [(c["name"], c["shows"]) for c in cards if c["kind"] == kind])
        click.echo(
            "`pamsim list protocols NAME` shows what it commands, with which load, and how long"
        )
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
