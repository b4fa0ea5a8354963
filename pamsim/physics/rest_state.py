"""States of a muscle at rest: the start of a run, and of a run that has settled."""

from __future__ import annotations

from pamsim.physics.chamber import air_state
from pamsim.physics.chamber_pressure import chamber_volume
from pamsim.physics.commands import MEASURED, PRESSURE_SET
from pamsim.physics.hysteresis.parallel import BLOCKS
from pamsim.physics.layout import (
    AIR,
    AMBIENT,
    CREEP,
    CREEP_2,
    EARLIER,
    LAST,
    LINE,
    PARALLEL,
    TUBE,
    MutableRow,
    Row,
    slot,
)
from pamsim.physics.muscle_length import chain_length, length_at_muscle
from pamsim.physics.static_muscle import contraction

_COMMAND = slot("command")
_POLYTROPIC = slot("chamber.polytropic_index")
_ATMOSPHERE = slot("chamber.atmosphere")


def charged_air_state(par: Row, act: Row, tendon_length: float, pressure: float) -> float:
    """Air state y that gives a gauge pressure.

    Args:
        par: (SIZE,) parameter row.
        act: states, of which the hysteresis operator's count.
        tendon_length: at the muscle [m].
        pressure: gauge [Pa].
    """
    inside = chamber_volume(par, act, tendon_length, pressure)
    return air_state(pressure + par[_ATMOSPHERE], inside, par[_POLYTROPIC])


def rest(par: Row, act: MutableRow, tendon_length: float, pressure: float) -> None:
    """Write the states of a muscle that has long been at rest.

    Args:
        par: (SIZE,) parameter row.
        act: (n,) written: the operators free of memory, the chain free of force and in the middle
            of its backlash, the creep relaxed, the command's line at what keeps the valves shut,
            the tube at the chamber's pressure, the air at the ambient temperature.
        tendon_length: [m].
        pressure: gauge pressure [Pa].
    """
    for i in range(len(act)):
        act[i] = 0.0
    length = chain_length(par, tendon_length)
    first, kappa = len(act) - PARALLEL, contraction(par, length)
    for i in range(BLOCKS):
        act[first + i] = kappa
    act[len(act) - AIR] = charged_air_state(par, act, length, pressure)
    for i in (TUBE, LAST, EARLIER):
        act[len(act) - i] = pressure + par[_ATMOSPHERE]
    inside = chamber_volume(par, act, length, pressure)
    act[len(act) - AMBIENT] = (pressure + par[_ATMOSPHERE]) * inside
    quieten(par, act, tendon_length, pressure)


def quieten(par: Row, act: MutableRow, tendon_length: float, pressure: float) -> None:
    """Relax the creep, and set line or pressure to what keeps the valves shut, or is measured.

    Args:
        par: (SIZE,) parameter row.
        act: (n,) states, of which these are written.
        tendon_length: [m].
        pressure: gauge pressure [Pa].
    """
    kappa = contraction(par, length_at_muscle(par, act, tendon_length))
    act[len(act) - CREEP] = kappa
    act[len(act) - CREEP_2] = kappa
    act[len(act) - LINE] = pressure if par[_COMMAND] == PRESSURE_SET else 0.0
    if par[_COMMAND] == MEASURED:
        act[len(act) - AIR] = pressure + par[_ATMOSPHERE]
