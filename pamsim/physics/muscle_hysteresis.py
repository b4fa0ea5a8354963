"""Hysteresis of a muscle: its own operator, and Maxwell slip in parallel.

Every function takes the parameter row ``par`` and the states ``act`` of one actuator in the layout
of `pamsim.physics.layout`.
"""

from __future__ import annotations

from pamsim.physics.hysteresis.dispatch import chosen_energy, chosen_output, chosen_rates
from pamsim.physics.hysteresis.group import COMMON_FIELDS
from pamsim.physics.hysteresis.maxwell_slip import slip_energy, slip_output, slip_rates
from pamsim.physics.hysteresis.parallel import BLOCKS
from pamsim.physics.layout import COMMON, PARALLEL, MutableRow, Row, slot

_LAW = slot("hysteresis.law")
_FORCE = slot("hysteresis.0")
_PER_PRESSURE, _SHARE, _CHORD = _FORCE + 1, _FORCE + 2, _FORCE + 3
_OWN = _FORCE + COMMON_FIELDS
_PARALLEL_FORCE = slot("parallel_hysteresis.force")
_PARALLEL_PER_PRESSURE = slot("parallel_hysteresis.force_per_pressure")
_PARALLEL_CHORD = slot("parallel_hysteresis.chord")
_FULL_SLIP = slot("parallel_hysteresis.full_slip")
_DECAY = slot("parallel_hysteresis.decay")
_NOMINAL_LENGTH = slot("braid.nominal_length")


def hysteresis_force(
    par: Row, act: Row, contraction: float, pressure: float, static_force: float
) -> float:
    """Force that hysteresis takes from the static force [N]; 0 without width.

    Args:
        par: parameter row.
        act: states.
        contraction: kappa [-].
        pressure: gauge pressure, not below 0 [Pa].
        static_force: signed force without hysteresis [N].
    """
    taken = 0.0
    if _has_own(par):
        width = par[_FORCE] + par[_PER_PRESSURE] * pressure + par[_SHARE] * static_force
        output = chosen_output(par[_LAW], par, _OWN, act, contraction)
        taken = width * (output - par[_CHORD] * contraction)
    if _has_parallel(par):
        width = par[_PARALLEL_FORCE] + par[_PARALLEL_PER_PRESSURE] * pressure
        at = len(act) - PARALLEL
        output = slip_output(BLOCKS, par[_FULL_SLIP], par[_DECAY], act, at, contraction)
        taken += width * (output - par[_PARALLEL_CHORD] * contraction)
    return taken


def hysteresis_volume(par: Row, act: Row, contraction: float) -> float:
    """Volume that the energy in the hysteresis takes [m^3]: minus its derivative by pressure.

    Without it a loop that is wider at a higher pressure could be loaded at a low one and unloaded
    at a high one, and give energy in every cycle. See `pamsim.physics.hysteresis.group`.

    Args:
        par: parameter row.
        act: states.
        contraction: kappa [-].
    """
    volume, square = 0.0, contraction * contraction
    per_pressure = par[_PER_PRESSURE]
    if par[_LAW] != 0.0 and per_pressure != 0.0:
        held = chosen_energy(par[_LAW], par, _OWN, act, contraction)
        held -= 0.5 * par[_CHORD] * square
        volume = -per_pressure * par[_NOMINAL_LENGTH] * held
    per_pressure = par[_PARALLEL_PER_PRESSURE]
    if per_pressure != 0.0:
        at = len(act) - PARALLEL
        held = slip_energy(BLOCKS, par[_FULL_SLIP], par[_DECAY], act, at, contraction)
        held -= 0.5 * par[_PARALLEL_CHORD] * square
        volume -= per_pressure * par[_NOMINAL_LENGTH] * held
    return volume


def hysteresis_rates(
    par: Row, act: Row, rates: MutableRow, contraction: float, rate: float, timestep: float
) -> None:
    """Write the rates of the memory; where there is no width, it is not kept up.

    Args:
        par: parameter row.
        act: states.
        rates: of all states [1/s], of which the memory's are written.
        contraction: kappa [-].
        rate: of the contraction [1/s].
        timestep: of the explicit Euler step that follows [s].
    """
    count = len(act)
    if _has_own(par):
        chosen_rates(par[_LAW], par, _OWN, act, rates, contraction, rate, timestep)
    else:
        for i in range(count - COMMON):
            rates[i] = 0.0
    at = count - PARALLEL
    if _has_parallel(par):
        slip_rates(BLOCKS, par[_FULL_SLIP], act, rates, at, contraction, timestep)
    else:
        for i in range(BLOCKS):
            rates[at + i] = 0.0


def _has_own(par: Row) -> bool:
    """Whether the muscle's own operator takes any force."""
    return par[_FORCE] + par[_PER_PRESSURE] + par[_SHARE] > 0.0


def _has_parallel(par: Row) -> bool:
    """Whether the one in parallel does."""
    return par[_PARALLEL_FORCE] + par[_PARALLEL_PER_PRESSURE] > 0.0
