"""``pamsim list``: rigs, parameters, laws, effects and inputs, as a table or one by one."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, save_json, show_card, show_list
from pamsim.cli.main import NamedGroup


@click.group(name="list", cls=NamedGroup)
def command() -> None:
    """List rigs, parameters, laws, effects or inputs; with a NAME, all about one of them."""


Card = tuple[str, Mapping[str, str]]
"""A title, and labelled texts."""


def _catalog(kind: str, *more: Any, **argument: Any) -> Callable[[Callable[..., Any]], Any]:
    """Make a function the command that lists a kind of names, or shows one of them.

    It gets a name or None and the values of more options. It returns the result, lists of names
    with a text each by title, what to type next, and the cards of the names.
    """

    def add(look_up: Callable[..., Any]) -> Any:
        @functools.wraps(look_up)
        def run(name: str | None, json_file: Path | None, **choices: Any) -> None:
            result, lists, hint, cards = look_up(name, **choices)
            save_json(json_file, result)
            if name is None:
                for title, rows in lists.items():
                    show_list(title, rows)
                click.echo(hint)
            for title, rows in cards if name else ():
                show_card(title, rows)

        for option in (options.json, *more, click.argument("name", required=False, **argument)):
            run = option(run)
        return command.command(name=kind, cls=Command)(run)

    return add


@_catalog("rigs", type=options.RIG)
def _rigs(name: str | None) -> Any:
    """List the rigs that come with pamsim, or show NAME, one of them or a rig folder."""
    from pamsim.engine.rig_cards import rig_cards

    result = rig_cards(name)
    lists = {"rigs for --rig": [(card["name"], card["purpose"]) for card in result["rigs"]]}
    hint = (
        "`pamsim list rigs NAME` shows joints, muscles and drives;"
        " `pamsim list params --rig NAME` its parameters"
    )
    return result, lists, hint, map(_rig, result["rigs"])


def _rig(card: dict[str, Any]) -> Card:
    drives = card["drives"]["muscles"] | card["drives"]["joints"]
    return (
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


@_catalog("params", options.rig, shell_complete=options.completed(options.parameter_names))
def _params(name: str | None, rig: str) -> Any:
    """List the parameters of a rig with value, range and source, or show the one called NAME.

    The names are those that `pamsim calibrate --free` takes. Values are in the units of the rig's
    params.toml, or in SI where it does not state them; ranges are in SI.
    """
    from pamsim.engine.rig_cards import parameter_cards

    result = parameter_cards(name, rig)
    cards = result["parameters"]
    rows = [(c["name"], f"{_value(c):24s} {c['range']:24s} {c['source']}") for c in cards]
    hint = f"`pamsim list params NAME --rig {rig}` shows meaning, intervals and notes"
    return result, {f"parameters of {result['rig']}": rows}, hint, map(_parameter, cards)


def _parameter(card: dict[str, Any]) -> Card:
    stated = card["stated"] or {}
    return f"{card['name']}: {card['doc']}", {
        "value": _value(card),
        "range": card["range"],
        "source": card["source"],
        "95 % interval": _ends(stated, "interval95"),
        "fitted within": _ends(stated, "bounds"),
        "note": stated.get("note", ""),
    }


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


@_catalog("models", options.laws_rig, shell_complete=options.completed(options.law_names))
def _models(name: str | None, rig: str | None) -> Any:
    """List all force laws and hysteresis operators, or show the one called NAME."""
    from pamsim.fitting.models import models

    result = models(name, rig)
    lists = {
        "force laws F(p, kappa); fit them with `pamsim fit`": map(_law, result["force_laws"]),
        "hysteresis operators": map(_law, result["operators"]),
    }
    hint = "`pamsim list models NAME` shows parameters, units, ranges and notes"
    return result, lists, hint, map(_model, (*result["force_laws"], *result["operators"]))


def _law(entry: dict[str, Any]) -> tuple[str, str]:
    return entry["name"], f"{entry['title']} ({entry['source']})\n{entry['equation']}"


def _model(entry: dict[str, Any]) -> Card:
    return f"{entry['name']}: {entry['title']}", {
        "equation": entry["equation"],
        "source": entry["source"],
        **{p["name"]: _coefficient(p) for p in entry["parameters"]},
        "of the braid": ", ".join(entry.get("braid", ())).replace("_", " "),
        "inverse p(F, kappa)": _yes(entry.get("inverse")),
        "rate-independent": _yes(entry.get("rate_independent")),
        "notes": entry["notes"],
    }


def _coefficient(p: dict[str, Any]) -> str:
    default = "" if p["default"] is None else f", default {p['default']:g}"
    return f"{p['range']:24s} {p['doc']}{default}"


def _yes(value: bool | None) -> str:
    return "" if value is None else "yes" if value else "no"


_also = click.option(
    "--rig", type=options.RIG, help="Also the effects of this rig, and what it cannot have."
)


@_catalog("effects", _also, shell_complete=options.completed(options.effect_names))
def _effects(name: str | None, rig: str | None) -> Any:
    """List the effects that a diagnosis can name, or show the one called NAME."""
    from pamsim.comparison.effects_on_rig import effect_cards

    result = effect_cards(name, rig)
    cards = result["effects"]
    lists = {
        family: [_effect(card) for card in cards if card["family"] == family]
        for family in sorted({card["family"] for card in cards})
    }
    hint = "`pamsim list effects NAME` shows parameters, look-alikes and separating experiment"
    return result, lists, hint, map(_effect_card, cards)


def _effect_card(card: dict[str, Any]) -> Card:
    form = f" ({card['form']})" if card["form"] else ""
    return f"{card['name']}{form}: {card['missing']}", {
        "equation": card["equation"],
        "parameters": ", ".join(card["parameters"]),
        "looks like": ", ".join(card["look_alikes"]) or "nothing else",
        "separated by": card["separating"],
        "tried at": ", ".join(card.get("places", ())),
        "not tried": card.get("not_tried") or "",
    }


def _effect(card: dict[str, str]) -> tuple[str, str]:
    note = f" [not on this rig: {card['not_tried']}]" if card.get("not_tried") else ""
    label = f"{card['name']}:{card['form']}" if card["form"] else card["name"]
    return label, f"{card['missing']}{note}"


@_catalog("protocols", shell_complete=options.completed(options.protocol_names))
def _protocols(name: str | None) -> Any:
    """List the inputs that `pamsim hide --protocols` takes, or show the one called NAME."""
    from pamsim.twins.protocol_cards import KINDS, protocol_cards

    def card(one: dict[str, Any]) -> Card:
        return f"{one['name']}: {one['shows']}", {
            "group": KINDS[one["kind"]],
            "commands": one["commands"],
            "load": f"{one['load']:g} kg",
            "trial": f"{one['duration']:g} s at {one['rate']:g} Hz",
        }

    result = protocol_cards(name)
    cards = result["protocols"]
    lists = {
        meaning: [(one["name"], one["shows"]) for one in cards if one["kind"] == kind]
        for kind, meaning in KINDS.items()
    }
    hint = "`pamsim list protocols NAME` shows what it commands, with which load, and how long"
    return result, lists, hint, map(card, cards)
