"""Options that several commands have, and the types of their values.

The name of an option's parameter is the name of the library's argument, so that a message of the
library about that argument, such as "`hold_out` leaves nothing to fit", can be shown with the flag
(see `pamsim.cli.main`).
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from pamsim.cli.command import NOTED, STANDARD_OUTPUT, given
from pamsim.core.errors import InputError
from pamsim.core.files import refuse_existing, results_folder

PATH = click.Path(path_type=Path)


def force(function: Any) -> Any:
    """``--force``, once for all options of a command that write; see `forced`."""
    if any(p.name == "force" for p in getattr(function, "__click_params__", ())):
        return function
    # Read before the options that it allows to write.
    settings = {**NOTED, "is_eager": True, "expose_value": False}
    return click.option("--force", help="Replace files that are there.", **settings)(function)


def resume(help: str) -> Any:
    """``--resume``: to go on with what is in the folder of ``--out``."""
    return click.option("--resume", is_eager=True, help=help, **NOTED)


def forced() -> bool:
    """Whether the command that runs may replace files."""
    return given("force")


def out(help: str, *, required: bool = False, default: str | None = None) -> Any:
    """``--out``: a folder for results, kept from other runs until the command ends."""

    def keep(context: click.Context, parameter: click.Parameter, value: Path | None) -> Path | None:
        if value is None:
            return None
        folder = results_folder(value, force=forced(), resume=given("resume"))
        # Of the root, which ends also where a later option is refused.
        return context.find_root().with_resource(folder)

    # Click takes a default of None for a value that an option has, and lets it be left out.
    usual: dict[str, Any] = {} if default is None else {"default": default}

    def add(function: Any) -> Any:
        option = click.option(
            "--out", type=PATH, required=required, callback=keep, help=help, **usual
        )
        return option(force(function))

    return add


def _free(context: click.Context, parameter: click.Parameter, value: Path | None) -> Path | None:
    if value is None or str(value) == STANDARD_OUTPUT:
        return value
    return refuse_existing(value, forced())


def json(function: Any) -> Any:
    """``--json``: a file for the result, or ``-`` for standard output."""
    option = click.option(
        "--json",
        "json_file",
        type=PATH,
        callback=_free,
        help="Write the result here; - for standard output.",
    )
    return option(force(function))


open_page = click.option("--open", expose_value=False, help="Show the page in a browser.", **NOTED)


def page(help: str, **more: Any) -> Any:
    """``--out``, ``--open`` and ``--json`` of a command that writes a page; see `out`."""
    return lambda function: out(help, **more)(open_page(json(function)))


film = click.option(
    "--film", is_flag=True, help="Film the trial with the largest gap, for the page: gap.gif."
)


class RigName(click.ParamType):
    """A shipped rig or a rig folder; a shell completes both."""

    name = "rig"

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Shipped rigs that begin so, and folders."""
        from pamsim.recordings.rig_file import shipped_rig_names

        found = [
            CompletionItem(name) for name in shipped_rig_names() if name.startswith(incomplete)
        ]
        return [*found, CompletionItem(incomplete, type="dir")]


RIG = RigName()

rig = click.option("--rig", type=RIG, default="mas20_arm", help="Shipped rig or rig folder.")
recorded_rig = click.option(
    "--rig", type=RIG, help="Shipped rig or rig folder; the recordings' own if left out."
)
shown_rig = click.option(
    "--rig", type=RIG, help="Shipped rig or rig folder; mas20_arm, or the recording's, if left out."
)
laws_rig = click.option("--rig", type=RIG, help="Also the laws of this rig's effects.py.")
threads = click.option(
    "--threads", type=int, help="Simulations at a time; one per processor if left out."
)
timestep = click.option(
    "--timestep-ms",
    "timestep",
    type=float,
    callback=lambda context, parameter, value: None if value is None else value / 1e3,
    help="Time step; the rig's own if left out.",
)


def seed(help: str = "Random seed.") -> Any:
    """``--seed``."""
    return click.option("--seed", type=click.IntRange(min=0), default=0, help=help)


Names = Callable[[click.Context], Mapping[str, str]]
"""Names that a value may have, each with a remark or none; looked up when a shell completes one."""


def completed(names: Names, separator: str = ",") -> Any:
    """Completion by known names; of several in one value, with a separator, the last."""

    def complete(
        context: click.Context, parameter: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        before, mark, last = incomplete.rpartition(separator)
        return [
            CompletionItem(f"{before}{mark}{name}", help=remark)
            for name, remark in names(context).items()
            if name.startswith(last)
        ]

    return complete


def listed(module: str, table: str) -> Any:
    """Completion by a table of the library, which is imported when its names are looked up."""
    return completed(lambda _: dict.fromkeys(getattr(importlib.import_module(module), table), ""))


def names(*declarations: str, help: str, names: Names | None = None) -> Any:
    """An option of names, separated by commas, that may be given again for more.

    The declarations are its flag, and its parameter where that has another name; ``help`` says what
    is named, and ``names`` are completed by a shell.
    """
    complete = {} if names is None else {"shell_complete": completed(names)}
    return click.option(
        *declarations, multiple=True, callback=_split, help=f"{help}: NAME,NAME.", **complete
    )


def effect_names(context: click.Context) -> Mapping[str, str]:
    """Effects of the package."""
    from pamsim.effects.catalog import EFFECTS

    return {name: effect.missing for name, effect in EFFECTS.items()}


def law_names(context: click.Context) -> Mapping[str, str]:
    """Force laws and hysteresis operators of the package."""
    from pamsim.physics.force_laws.catalog import FORCE_LAWS
    from pamsim.physics.hysteresis.catalog import OPERATORS

    return {one.name: one.title for one in (*FORCE_LAWS.values(), *OPERATORS.values())}


def protocol_names(context: click.Context) -> Mapping[str, str]:
    """Inputs of synthetic recordings."""
    from pamsim.twins.protocol_cards import protocol_cards

    return {card["name"]: card["shows"] for card in protocol_cards()["protocols"]}


def parameter_names(context: click.Context) -> Mapping[str, str]:
    """Parameters of the rig that is given, or of the default rig."""
    from pamsim.engine.parameters import rig_parameters
    from pamsim.engine.rig import load_rig

    rig = load_rig(context.params.get("rig") or "mas20_arm")
    return {parameter.name: parameter.spec.doc for parameter in rig_parameters(rig)}


def _split(
    context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]
) -> tuple[str, ...]:
    """The names in all texts; one without any would pass as the option left out."""
    found: list[str] = []
    for text in texts:
        names = [part.strip() for part in text.split(",") if part.strip()]
        if not names:
            raise InputError(f"{parameter.opts[0]} {text!r} names nothing; leave the option out")
        found += names
    return tuple(found)


class Quantity(click.ParamType):
    """A number with an optional unit, such as ``6`` or ``800ms``; the value is in SI."""

    name = "quantity"

    def __init__(self, unit: str, si_unit: str) -> None:
        """Set the unit of a number without one, and that of the value."""
        self._unit, self._si_unit = unit, si_unit

    def convert(self, value: Any, param: click.Parameter | None, ctx: Any) -> float:
        """Read the text of an option [SI]; an `InputError` if it is no such quantity."""
        from pamsim.core.units import parse_quantity

        if isinstance(value, float):
            return value
        where = param.opts[0] if param else self.name
        return parse_quantity(value, self._unit, self._si_unit, where=where)


class Quantities(Quantity):
    """Quantities separated by commas, such as ``487,0`` or ``4.87bar,0``."""

    name = "quantities"

    def convert(self, value: Any, param: click.Parameter | None, ctx: Any) -> Any:
        """Read the text of an option [SI], shape (n,)."""
        if isinstance(value, list):
            return value
        return [super(Quantities, self).convert(part, param, ctx) for part in value.split(",")]


PRESSURES = Quantities("kPa", "Pa")
SECONDS = Quantity("s", "s")


class _Load(Quantity):
    """A mass that an arm of such muscles can carry."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: Any) -> float:
        """Read the text of an option [kg]."""
        from pamsim.core.limits import HEAVIEST_LOAD

        mass = super().convert(value, param, ctx)
        if mass > HEAVIEST_LOAD:
            raise InputError(
                f"--load {mass:,g} kg is above {HEAVIEST_LOAD:g} kg; if it is in grams, write"
                f" {mass:g}g"
            )
        return mass


def load(help: str, **more: Any) -> Any:
    """``--load``: a mass [kg]."""
    return click.option("--load", type=_Load("kg", "kg"), help=help, **more)


def refuse(why: str, **options: object) -> None:
    """Refuse options that do not apply, by an `InputError` for the first that was given.

    ``why`` ends the sentence that begins with the option, such as ``needs a RECORDING``.
    """
    for name, value in options.items():
        if value is not None:
            raise InputError(f"`{name}` {why}")
