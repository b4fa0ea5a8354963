"""Options that several commands have, and the types of their values.

The name of an option's parameter is the name of the library's argument, so that a message of the
library about that argument, such as "`hold_out` leaves nothing to fit", can be shown with the flag
(see `pamsim.cli.main`).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pamsim.core.errors import InputError

PATH = click.Path(path_type=Path)

json_option = click.option("--json", "json_file", type=PATH, help="Write the result here.")
force_option = click.option("--force", is_flag=True, help="Replace files that are there.")
rig_option = click.option(
    "--rig", default="mas20_arm", show_default=True, help="Shipped rig or rig folder."
)
threads_option = click.option(
    "--threads", type=int, help="Simulations at a time; one per processor if left out."
)


def names_option(*declarations: str, help: str) -> Any:
    """An option of names, separated by commas, that may be given again for more.

    Args:
        declarations: flag, and parameter name where it differs.
        help: what is named.
    """
    return click.option(*declarations, multiple=True, callback=_split, help=f"{help}: NAME,NAME.")


def _split(context: Any, parameter: Any, texts: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(part.strip() for text in texts for part in text.split(",") if part.strip())


class Quantity(click.ParamType):
    """A number with an optional unit, such as ``6`` or ``800ms``; the value is in SI."""

    name = "quantity"

    def __init__(self, unit: str, si_unit: str) -> None:
        """Set the units.

        Args:
            unit: of a number without one.
            si_unit: of the value.
        """
        self._unit, self._si_unit = unit, si_unit

    def convert(self, value: Any, param: click.Parameter | None, ctx: Any) -> float:
        """Read the text of an option [SI].

        Raises:
            InputError: if it is no number, or its unit is unknown or measures another quantity.
        """
        from pamsim.core.units import parse_quantity

        if isinstance(value, float):
            return value
        where = param.opts[0] if param else self.name
        return parse_quantity(value, self._unit, self._si_unit, where=where)


class Quantities(click.ParamType):
    """Quantities separated by commas, such as ``487,0`` or ``4.87bar,0``."""

    name = "quantities"

    def __init__(self, unit: str, si_unit: str) -> None:
        """Set the units, as of `Quantity`."""
        self._each = Quantity(unit, si_unit)

    def convert(self, value: Any, param: click.Parameter | None, ctx: Any) -> list[float]:
        """Read the text of an option [SI], shape (n,).

        Raises:
            InputError: as `Quantity.convert`.
        """
        if isinstance(value, list):
            return value
        return [self._each.convert(part, param, ctx) for part in value.split(",")]


PRESSURES = Quantities("kPa", "Pa")
SECONDS = Quantity("s", "s")
KILOGRAMS = Quantity("kg", "kg")


def refuse(why: str, **options: object) -> None:
    """Refuse options that do not apply.

    Args:
        why: end of the sentence that begins with the option, such as ``needs a RECORDING``.
        options: parameter name -> value; None if the option was not given.

    Raises:
        InputError: for the first that was given.
    """
    for name, value in options.items():
        if value is not None:
            raise InputError(f"`{name}` {why}")
