"""Parameters and states of one actuator as records, which the kernel reads by name.

``model.actuator_user`` holds the parameters of an actuator and ``data.act`` its memory, so a saved
model and a saved state replay bit for bit, and a batch can give every simulation its own
parameters. Both are plain rows of numbers to the engine. Here each is a record: the parameter
groups give the names, so ``m.valve.supply_pressure`` is the one of a rig's file.
Compiled code views the row itself; plain Python reads a namespace of the same names.
"""

from __future__ import annotations

import dataclasses
import functools
from collections import defaultdict
from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any, TypeAlias

import numpy as np

from pamsim.core.catalog import MOST_PARAMETERS
from pamsim.core.errors import EngineError, InputError, nearest
from pamsim.core.parameters import ParameterGroup, specs
from pamsim.core.units import FloatArray
from pamsim.physics.braid import Braid
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.effective_area import Stroke
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.group import Hysteresis, Row
from pamsim.physics.hysteresis.group import MutableRow as MutableRow
from pamsim.physics.hysteresis.maxwell_slip import BLOCKS
from pamsim.physics.muscle import COMMANDS, PLAIN_GROUPS, Muscle, plain_groups

Parameters: TypeAlias = Any
"""``m``: a record of `record_dtype` in compiled code, in Python what `view` returns."""
States: TypeAlias = Any
"""``s``: a record of `STATES`, or a namespace of the same names."""

SIGNATURE = 7240.288
"""First number of every pamsim muscle's row. MJCF is written with six digits, so the numbers of a
model that was saved as MJCF are no longer exact, and this one shows it."""

STATE_WORDS = {
    "softened": "softening",  # share of that which a run has brought so far
    "furthest": "furthest contraction",  # of all strokes so far
    "bonds": "bonds of dry friction",  # as a share of those after a long rest
    "earlier_pressure": "pressure before",  # of the step before last; used if it is searched for
    "last_pressure": "pressure before",  # absolute, of the last step
    "ambient_air": "air at ambient temperature",  # pressure times volume that it would have there
    "creep_2": "creep",  # contraction of the second element's dashpot
    "tube_pressure": "pressure in the tube",  # absolute, at the valves' end
    "opening": "valves' opening",  # of slow valves
    "sag": "supply's sag",  # as a share; the same in all muscles on it
    "friction": "dry friction",  # along the tendon [N]
    "line": "command's line",  # the command as it leaves it
    "creep": "creep",
    "shift": "chain's shift",  # on the sprocket [m]
    "extension": "chain's extension",  # [m]
    # Air state y = P^(1/n) V; the pressure itself where that is measured.
    "air": "air (a chamber without volume has no pressure)",
}
"""States that every muscle has, at the end of its ``act`` -> what they are, for a reader. All exist
even where an effect is off, so that any effect can be added to a compiled model. Before them lies
the memory: the hysteresis operator's states, then the blocks of the one in parallel."""

STATE_NAMES = tuple(STATE_WORDS)

STATES = np.dtype([(name, np.float64) for name in STATE_NAMES])

COMMON = BLOCKS + len(STATE_NAMES)
"""Number of states that every muscle has."""


def _record(fields: Mapping[str, tuple[Any, int]], size: int) -> np.dtype[Any]:
    """A record of ``size`` numbers, from the type of each field and its place in the row."""
    kinds, places = zip(*fields.values(), strict=True)
    offsets = [8 * place for place in places]
    layout = {"names": list(fields), "formats": kinds, "offsets": offsets, "itemsize": 8 * size}
    return np.dtype(layout)  # pyright: ignore[reportCallIssue, reportArgumentType]


@functools.cache
def record_dtype(
    force: type[ParameterGroup] | None = None, hysteresis: type[ParameterGroup] | None = None
) -> np.dtype[Any]:
    """Nested record of a muscle's row.

    Args:
        force: group of its force law, whose fields are then named; None for a row of any law.
        hysteresis: group of its hysteresis operator, likewise.

    Returns:
        Record with ``signature``, ``command``, ``partner`` (the id of the actuator at the other end
        of the chain plus 1, 0 for none) and one record per group. ``law`` of ``force`` and of
        ``hysteresis`` is the code of the law; ``force.pushes`` and ``force.volume_varies`` are 1 or
        0 as its card says.
    """
    fields: dict[str, tuple[Any, int]] = {
        name: ("<f8", place) for place, name in enumerate(("signature", "command", "partner"))
    }
    end = len(fields)
    for group in PLAIN_GROUPS:
        count, start = len(specs(group)), end
        places = list(range(count))
        if group is Stroke:
            # What contraction is taken against is one number: `stroke` continues `braid`.
            start = fields[Braid.group][1]
            places = [0, *range(end - start, end - start + count - 1)]
        end = start + places[-1] + 1
        own = {name: ("<f8", at) for (name, _), at in zip(specs(group), places, strict=True)}
        fields[group.group] = _record(own, places[-1] + 1), start
    # Every force law begins with a scale. Without an operator the width of its loop is there, as 0.
    for name, chosen, first, common in (
        ("force", force, ("pushes", "volume_varies", "law"), ("scale",)),
        ("hysteresis", hysteresis, ("law",), tuple(field for field, _ in specs(Hysteresis))),
    ):
        names = first + (common if chosen is None else tuple(field for field, _ in specs(chosen)))
        size = len(first) + MOST_PARAMETERS
        fields[name] = _record({field: ("<f8", at) for at, field in enumerate(names)}, size), end
        end += size
    return _record(fields, end)


SIZE = record_dtype().itemsize // 8
"""Length of the row: what ``nuser_actuator`` must be at least."""


@functools.cache
def places_in_row(*laws: type[ParameterGroup] | None) -> dict[str, int]:
    """Place in the row of every number of `record_dtype`, whose arguments it takes."""
    found: dict[str, int] = {}
    fields: Any = record_dtype(*laws).fields
    for name, (kind, first) in fields.items():
        if kind.names is None:
            found[name] = first // 8
        for inner in kind.names or ():
            found[f"{name}.{inner}"] = (first + kind.fields[inner][1]) // 8
    return found


def slot(name: str, muscle: Muscle | None = None) -> int:
    """Place of a parameter in the row by its name, such as ``chamber.dead_volume``.

    Args:
        name: ``group.field``, ``command`` or ``partner``.
        muscle: whose laws' parameters are known as well, such as ``force.scale``, and only groups
            that have a meaning for it; None for any.

    Raises:
        InputError: if there is no such parameter, with the nearest name.
    """
    known = places_in_row() if muscle is None else _slots_of(*map(type, muscle.groups))
    if name not in known:
        raise InputError(f"no muscle parameter {name!r}; {nearest(name, known)}")
    return known[name]


def has_parameter(muscle: Muscle, name: str) -> bool:
    """Whether a muscle has a parameter of a name, as `slot` takes it."""
    return name in _slots_of(*map(type, muscle.groups))


@functools.cache
def _slots_of(*groups: type[ParameterGroup]) -> dict[str, int]:
    chosen = {group.group: group for group in groups}
    every = places_in_row(chosen.get("force"), chosen.get("hysteresis"))
    names = (f"{group.group}.{name}" for group in groups for name, _ in specs(group))
    return {name: every[name] for name in names}


def state_size(muscle: Muscle) -> int:
    """Number of states of one muscle: its hysteresis operator's and those that all have."""
    return (muscle.hysteresis.state_count if muscle.hysteresis else 0) + COMMON


def pack(muscle: Muscle) -> FloatArray:
    """The row of a muscle, (SIZE,) parameters in SI, for ``model.actuator_user``."""
    row = np.zeros(SIZE)
    hysteresis = None if muscle.hysteresis is None else type(muscle.hysteresis)
    places = places_in_row(type(muscle.force), hysteresis)
    row[places["signature"]] = SIGNATURE
    row[places["command"]] = COMMANDS.index(muscle.command)
    card = FORCE_LAWS.card(type(muscle.force))
    row[places["force.law"]] = FORCE_LAWS.code(type(muscle.force))
    row[places["force.pushes"]], row[places["force.volume_varies"]] = (
        card.pushes,
        card.volume_varies,
    )
    if hysteresis is not None:
        row[places["hysteresis.law"]] = OPERATORS.code(hysteresis)
    # Groups without meaning are there as well: the kernel divides by some of their neutral values.
    for group in vars(muscle).values():
        if isinstance(group, ParameterGroup):
            for name, _ in specs(type(group)):
                row[places[f"{group.group}.{name}"]] = getattr(group, name)
    return row


def laws_of(row: Row) -> tuple[type[ParameterGroup], type[ParameterGroup] | None]:
    """Groups of the force law and of the hysteresis operator that a row names.

    Raises:
        EngineError: if a code stands for no law.
    """
    law, operator = float(row[slot("force.law")]), float(row[slot("hysteresis.law")])
    return FORCE_LAWS.group(law), OPERATORS.group(operator) if operator else None


def unpack(row: Row) -> Muscle:
    """Read a muscle back from a row; the inverse of `pack`.

    Raises:
        EngineError: if the row is not a pamsim muscle, or a code in it stands for no law.
        ParameterError: if a number in it has been set out of range.
    """
    if not is_muscle(row):
        raise EngineError("this actuator is not a pamsim muscle: its user data has no signature")
    m, laws = view(row), laws_of(row)
    kinds = plain_groups(FORCE_LAWS.card(laws[0]).pushes) + tuple(law for law in laws if law)
    groups = {kind.group: kind(**_numbers(m, kind)) for kind in kinds}
    if m.command not in range(len(COMMANDS)):
        raise EngineError(f"command = {m.command:g} in an actuator's user data stands for nothing")
    return Muscle(command=COMMANDS[int(m.command)], **groups)  # pyright: ignore[reportArgumentType]


def with_row(muscle: Muscle, row: Row) -> Muscle:
    """A muscle with the numbers of a row with the same laws, as `unpack` reads them.

    Groups whose numbers do not change are the muscle's own, so it is much quicker than `unpack`.

    Raises:
        ParameterError: if a number has been set out of range.
    """
    m, changed = view(row), dict[str, Any]()
    for group in muscle.groups:
        numbers = _numbers(m, type(group))
        if any(getattr(group, name) != number for name, number in numbers.items()):
            changed[group.group] = type(group)(**numbers)
    return dataclasses.replace(muscle, **changed) if changed else muscle


def _numbers(m: Parameters, group: type[ParameterGroup]) -> dict[str, float]:
    record = getattr(m, group.group)
    return {name: getattr(record, name) for name, _ in specs(group)}


def is_muscle(row: Row) -> bool:
    """Whether an actuator's user data is a pamsim muscle."""
    return len(row) >= SIZE and float(row[0]) == SIGNATURE


def view(row: Row) -> Parameters:
    """The record of a row (SIZE,) for the kernel in plain Python.

    It is a namespace of numbers and, per group, namespaces; a copy, whose numbers may be changed.

    Raises:
        EngineError: if a code stands for no law.
    """
    numbers: list[float] = np.asarray(row, dtype=float).tolist()

    def named(fields: _Fields) -> dict[str, float]:
        names, places = fields
        return dict(zip(names, map(numbers.__getitem__, places), strict=True))

    own, groups = _fields_by_group(*laws_of(row))
    records = {group: SimpleNamespace(**named(fields)) for group, fields in groups}
    return SimpleNamespace(**named(own), **records)


_Fields: TypeAlias = tuple[tuple[str, ...], tuple[int, ...]]
"""Names of numbers, and their places in a row."""


@functools.cache
def _fields_by_group(
    *laws: type[ParameterGroup] | None,
) -> tuple[_Fields, list[tuple[str, _Fields]]]:
    """Numbers outside groups, and those in each; every run of a batch asks."""
    groups: defaultdict[str, dict[str, int]] = defaultdict(dict)
    for name, place in places_in_row(*laws).items():
        group, _, field = name.rpartition(".")
        groups[group][field] = place
    own = groups.pop("")
    fields = {group: (tuple(places), tuple(places.values())) for group, places in groups.items()}
    return (tuple(own), tuple(own.values())), [*fields.items()]


def parameters(muscle: Muscle) -> Parameters:
    """The record of a muscle for the kernel in plain Python, see `view`."""
    return view(pack(muscle))


def split_states(act: Row) -> tuple[States, list[float]]:
    """States of a muscle by name, and its memory of hysteresis (n - 16,), from its ``act`` (n,).

    For the kernel in plain Python; copies, in SI.
    """
    numbers = np.asarray(act, dtype=float).tolist()
    count = len(numbers) - len(STATE_NAMES)
    return SimpleNamespace(**dict(zip(STATE_NAMES, numbers[count:], strict=True))), numbers[:count]


def joined_states(states: States, memory: Sequence[float]) -> list[float]:
    """``act`` of one actuator from what `split_states` returns, in SI."""
    return [*memory, *(getattr(states, name) for name in STATE_NAMES)]
