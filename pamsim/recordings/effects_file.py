"""A rig's own laws and effects: the Python file ``effects.py`` in its folder.

It defines ``LAWS``, a sequence of `pamsim.physics.force_laws.force_law.ForceLaw` and
`pamsim.physics.hysteresis.catalog.Operator`, or ``EFFECTS``, one of
`pamsim.effects.effect.Effect`, or both. Reading a rig runs that file: read no rig whose origin you
do not know.
"""

from __future__ import annotations

import functools
import sys
import traceback
import types
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pamsim.core.errors import InputError, PamsimError
from pamsim.effects.effect import Effect
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.force_law import ForceLaw
from pamsim.physics.hysteresis.catalog import OPERATORS, Operator

FILE = "effects.py"


@dataclass(frozen=True, kw_only=True)
class OwnPhysics:
    """What a rig adds to the package.

    Attributes:
        laws: force laws.
        operators: of hysteresis.
        effects: that a diagnosis may name.
    """

    laws: tuple[ForceLaw, ...] = ()
    operators: tuple[Operator, ...] = ()
    effects: tuple[Effect, ...] = ()


def read_effects(folder: Path) -> OwnPhysics:
    """Run a rig's ``effects.py`` and add its laws to the catalogs.

    Args:
        folder: of the rig; without the file it adds nothing.

    Raises:
        InputError: if the file fails, or holds something else than laws and effects.
    """
    path = folder / FILE
    if not path.is_file():
        return OwnPhysics()
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text: {error}") from None
    own = _own_physics(path.resolve(), text)
    # Every time: the newest of a name is what the catalogs list, also of two rigs in turn.
    for law in own.laws:
        FORCE_LAWS.add(law, str(path))
    for operator in own.operators:
        OPERATORS.add(operator, str(path))
    return own


@functools.cache
def _own_physics(path: Path, text: str) -> OwnPhysics:
    # A module, so that its classes know where they come from; no cached bytecode beside the rig.
    module = types.ModuleType(f"pamsim_rig_{zlib.crc32(str(path).encode()):08x}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module
    try:
        exec(compile(text, str(path), "exec"), module.__dict__)
    except PamsimError as error:
        raise InputError(f"{path}: {error}") from None
    except Exception as error:  # whatever the rig's own code raises
        lines = [
            f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)
        ]
        line = getattr(error, "lineno", None) or (lines[-1] if lines else 1)
        raise InputError(f"{path}, line {line}: {type(error).__name__}: {error}") from None
    laws = _each(module, path, "LAWS", (ForceLaw, Operator))
    return OwnPhysics(
        laws=tuple(law for law in laws if isinstance(law, ForceLaw)),
        operators=tuple(law for law in laws if isinstance(law, Operator)),
        effects=_each(module, path, "EFFECTS", (Effect,)),
    )


def _each(
    module: types.ModuleType, path: Path, name: str, kinds: tuple[type, ...]
) -> tuple[Any, ...]:
    found = getattr(module, name, ())
    wanted = " and ".join(kind.__name__ for kind in kinds)
    if not isinstance(found, list | tuple):
        raise InputError(f"{path}: {name} must be a list of {wanted}")
    for one in found:
        if not isinstance(one, kinds):
            raise InputError(f"{path}: {name} holds {one!r}; write objects of {wanted}")
    return tuple(found)
