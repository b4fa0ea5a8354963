"""``pamsim list models``: force laws and hysteresis operators, with parameters and ranges."""

from __future__ import annotations

import os
from typing import Any

from pamsim.core.encoding import fields_to_dict, to_dict
from pamsim.core.errors import InputError, nearest
from pamsim.core.parameters import specs
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.force_law import ForceLaw
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.group import Operator
from pamsim.recordings.rig_file import add_rigs_laws

SCHEMA = "pamsim-models/1"


def models(name: str | None = None, rig: str | os.PathLike[str] | None = None) -> dict[str, Any]:
    """Describe all laws and operators, those of a ``rig`` folder as well, or one by its name.

    JSON-safe mapping ``force_laws`` and ``operators``, each a list with name, title, equation,
    source, notes and parameters; ranges in SI, None for an end that is not limited.

    Raises:
        InputError: for an unknown name, with the nearest, or an unknown rig.
    """
    add_rigs_laws(rig)
    if name is not None and name not in FORCE_LAWS and name not in OPERATORS:
        raise InputError(f"no model {name!r}; {nearest(name, [*FORCE_LAWS, *OPERATORS])}")
    laws = [
        {
            **_card(law),
            "braid": law.braid_fields,
            "inverse": law.pressure_range is not None,
            "pressure_pa": law.pressure_range,
        }
        for law in FORCE_LAWS.values()
        if name in (None, law.name)
    ]
    operators = [
        {**_card(operator), "rate_independent": operator.rate_independent}
        for operator in OPERATORS.values()
        if name in (None, operator.name)
    ]
    return to_dict({"schema": SCHEMA, "force_laws": laws, "operators": operators})


def _card(one: ForceLaw | Operator) -> dict[str, Any]:
    words = ("name", "title", "equation", "source", "notes")
    parameters = [
        {
            "name": name,
            **fields_to_dict(spec),
            "range": spec.range_text(),
            "default": spec.default,
        }
        for name, spec in specs(one.group)
    ]
    return {**{word: getattr(one, word) for word in words}, "parameters": parameters}
