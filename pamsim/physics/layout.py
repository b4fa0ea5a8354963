"""Where each number of a muscle lies: in ``model.actuator_user`` and in ``data.act``.

All parameters are stored in the model and all memory in the state, so a saved model and a saved
state replay bit for bit, and a batch can give every simulation its own parameters.

``actuator_user`` row: signature, codes of the chosen laws, the actuator at the other end of the
chain (its id plus 1, 0 for none), then every group's fields in their declared order. ``act`` of one
actuator: the hysteresis operator's states, the blocks of the one in parallel, then one each for
the pressure of the last step but one and of the last, where the search for it begins if the volume
depends on it, the air's pressure at ambient temperature times its volume, the second element of the
creep, the pressure at the valves' end of the tube, the opening of slow valves, the supply's sag (of
which all muscles on it hold the same value), the dry friction along the tendon, the command's line,
the creep, the chain's shift on the sprocket, the chain's extension, and the air state y, in whose
place a measured pressure is. All of them exist even where an effect is off, so that any effect can
be added to a compiled model.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator, MutableSequence, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pamsim.core.catalog import MOST_PARAMETERS
from pamsim.core.errors import EngineError, InputError, nearest
from pamsim.core.parameters import ParameterGroup, specs
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.dispatch import pushes
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.parallel import BLOCKS
from pamsim.physics.muscle import (
    COMMANDS,
    MUSCLE_ONLY,
    PLAIN_GROUPS,
    PUSHING_ONLY,
    Muscle,
)

Row: TypeAlias = Sequence[float] | NDArray[np.float64]
MutableRow: TypeAlias = MutableSequence[float] | NDArray[np.float64]

_SHARED = {"stroke.nominal_length": "braid.nominal_length"}
"""A number in the slot of another: what contraction is taken against, of either kind."""

SIGNATURE = 7240.288
"""First number of every pamsim muscle's row, by which it is recognised."""

EARLIER, LAST, AMBIENT, CREEP_2, TUBE, OPENING, SAG, RUBBING = 13, 12, 11, 10, 9, 8, 7, 6
LINE, CREEP, SHIFT, EXTENSION, AIR = 5, 4, 3, 2, 1
"""Where the states that every muscle has lie in its ``act``, counted from its end."""

PARALLEL = EARLIER + BLOCKS
"""Where the blocks of the parallel hysteresis begin, counted in the same way."""

COMMON = PARALLEL
"""Number of states that every muscle has."""


def _names() -> Iterator[str]:
    yield from ("signature", "command", "force.law", "hysteresis.law", "partner")
    for group in PLAIN_GROUPS:
        names = (f"{group.group}.{name}" for name, _ in specs(group))
        yield from (name for name in names if name not in _SHARED)
    yield from (f"force.{i}" for i in range(MOST_PARAMETERS))
    yield from (f"hysteresis.{i}" for i in range(MOST_PARAMETERS))


NAMES: tuple[str, ...] = tuple(_names())
"""Name of every slot of the row. Slots of a chosen law are numbered in its fields' order."""

_PLACES = {name: place for place, name in enumerate(NAMES)}

SIZE = len(NAMES)
"""Length of the row: what ``nuser_actuator`` must be at least."""


def slot(name: str) -> int:
    """Index of a slot by its name, such as ``chamber.dead_volume``.

    Raises:
        InputError: if there is no such slot, with the nearest name.
    """
    try:
        return _PLACES[_SHARED.get(name, name)]
    except KeyError:
        raise InputError(f"no muscle parameter {name!r}; {nearest(name, NAMES)}") from None


def parameter_slot(muscle: Muscle, name: str) -> int:
    """Index of a parameter of a given muscle, also of its chosen laws, such as ``force.scale``.

    Raises:
        InputError: if the muscle has no such parameter.
    """
    known = _slots_by_name(muscle)
    if name not in known:
        raise InputError(f"no muscle parameter {name!r}; {nearest(name, known)}")
    return known[name]


def has_parameter(muscle: Muscle, name: str) -> bool:
    """Whether a muscle has a parameter of a name, as `parameter_slot` takes it."""
    return name in _slots_by_name(muscle)


def state_size(muscle: Muscle) -> int:
    """Number of states of one muscle: its hysteresis operator's and those that all have."""
    return (muscle.hysteresis.state_count if muscle.hysteresis else 0) + COMMON


def pack(muscle: Muscle) -> NDArray[np.float64]:
    """Write a muscle into a row.

    Returns:
        (SIZE,) parameters in SI, for ``model.actuator_user``.
    """
    row = np.zeros(SIZE)
    row[slot("signature")] = SIGNATURE
    row[slot("command")] = COMMANDS.index(muscle.command)
    row[slot("force.law")] = FORCE_LAWS.code(type(muscle.force))
    if muscle.hysteresis is not None:
        row[slot("hysteresis.law")] = OPERATORS.code(type(muscle.hysteresis))
    # Groups without meaning are there as well: the kernel divides by some of their neutral values.
    for group in vars(muscle).values():
        if isinstance(group, ParameterGroup):
            for index, name in _slots_of(type(group)):
                row[index] = getattr(group, name)
    return row


def unpack(row: Row) -> Muscle:
    """Read a muscle back from a row; the inverse of `pack`.

    Raises:
        EngineError: if the row is not a pamsim muscle, or a code in it stands for no law.
        ParameterError: if a number in it has been set out of range.
    """
    if not is_muscle(row):
        raise EngineError("this actuator is not a pamsim muscle: its user data has no signature")
    groups: dict[str, ParameterGroup] = {}
    law, operator = float(row[slot("force.law")]), float(row[slot("hysteresis.law")])
    force = FORCE_LAWS.group(law)
    idle = MUSCLE_ONLY if pushes(law) else PUSHING_ONLY
    for group in (group for group in PLAIN_GROUPS if group not in idle):
        fields = {name: float(row[slot(f"{group.group}.{name}")]) for name, _ in specs(group)}
        groups[group.group] = group(**fields)
    groups["force"] = force(**_slots(force, row))
    if operator:
        hysteresis = OPERATORS.group(operator)
        groups["hysteresis"] = hysteresis(**_slots(hysteresis, row))
    command = float(row[slot("command")])
    if command not in range(len(COMMANDS)):
        raise EngineError(f"command = {command:g} in an actuator's user data stands for nothing")
    return Muscle(command=COMMANDS[int(command)], **groups)  # pyright: ignore[reportArgumentType]


def with_row(muscle: Muscle, row: NDArray[np.float64], before: NDArray[np.float64]) -> Muscle:
    """A muscle with the numbers of a row, as `unpack` reads them; its laws stay.

    Groups whose numbers do not change are the muscle's own, so it is much quicker than `unpack`.

    Args:
        muscle: as packed in ``before``.
        row: (SIZE,) with the same laws.
        before: (SIZE,).

    Raises:
        ParameterError: if a number has been set out of range.
    """
    changed = set(np.flatnonzero(row != before).tolist())
    groups: dict[str, ParameterGroup] = {}
    for group in muscle.groups if changed else ():
        slots = _slots_of(type(group))
        if not changed.isdisjoint(index for index, _ in slots):
            fields = {name: float(row[index]) for index, name in slots}
            groups[group.group] = dataclasses.replace(group, **fields)
    return dataclasses.replace(muscle, **groups) if groups else muscle


def is_muscle(row: Row) -> bool:
    """Whether an actuator's user data is a pamsim muscle."""
    return len(row) >= SIZE and float(row[0]) == SIGNATURE


def _slots(group: type[ParameterGroup], row: Row) -> dict[str, float]:
    first = slot(f"{group.group}.0")
    return {name: float(row[first + i]) for i, (name, _) in enumerate(specs(group))}


def _slots_by_name(muscle: Muscle) -> dict[str, int]:
    """Slot of every parameter that has a meaning for a muscle."""
    return _slots_of_all(tuple(type(group) for group in muscle.groups))


@functools.cache
def _slots_of_all(groups: tuple[type[ParameterGroup], ...]) -> dict[str, int]:
    return {f"{group.group}.{name}": index for group in groups for index, name in _slots_of(group)}


@functools.cache
def _slots_of(group: type[ParameterGroup]) -> tuple[tuple[int, str], ...]:
    """Slot and name of every field of a group."""
    chosen = group not in PLAIN_GROUPS
    return tuple(
        (slot(f"{group.group}.{i if chosen else name}"), name)
        for i, (name, _) in enumerate(specs(group))
    )
