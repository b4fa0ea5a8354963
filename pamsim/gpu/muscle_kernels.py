"""The muscles' step and gauges as Warp kernels: a thread for each muscle of each world."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pamsim.gpu.port import port
from pamsim.gpu.warp_package import warp
from pamsim.physics import chamber_pressure as chamber
from pamsim.physics import kernel, muscle_valves, supply
from pamsim.physics.record import STATE_NAMES, slot

_PARTNER, _BACKLASH = slot("partner"), slot("chain.backlash")
_RESISTANCE, _SUPPLY_LINE = slot("valve.supply_resistance"), slot("valve.supply_line")
_SQUARE = slot("valve.supply_square")
_NAMED = len(STATE_NAMES)


@dataclass(frozen=True, kw_only=True)
class MuscleKernels:
    """Warp kernels over n worlds of m muscles, whose numbers are of one precision, F.

    Attributes:
        step: rates and forces at the start of a time step: parameters (n, m, SIZE) F, states and,
            written, their rates (n, na) F; lengths, speeds (n, m) and commands of the engine;
            times (n,) in double precision [s], time step [s] F; places (m, 2) of each muscle's
            first state and their number; scratch (n, m, m, VALVE) F for the supplies' valves, or
            (1, 1, 1, VALVE) without any; the engine's forces (n, m) [N], written.
        read: parameters, states, lengths, speeds and places as before; gauge pressures [Pa] and
            tensions [N] (n, m) F, written.
        advance: an Euler step of the states (n, na) F by their rates, and of the times (n,) [s];
            time step [s] F, and in double precision; the engine's copy of the states (n, na),
            written. A thread for each world.
    """

    step: Any
    read: Any
    advance: Any


@functools.cache
def muscle_kernels(precision: str) -> MuscleKernels:
    """The kernels in a precision; they are compiled when they are first launched.

    Raises:
        InputError: for an unknown precision, or if Warp is not installed.
    """
    wp, laws = warp(), port(precision)
    F = laws.scalar
    tension = laws.function(kernel.tension)
    chamber_pressure = laws.function(chamber.chamber_pressure)
    state_rates = laws.function(kernel.state_rates)
    tendon_force = laws.function(kernel.tendon_force)
    fill_valve_of = laws.function(supply.fill_valve_of)
    supply_sag = laws.function(supply.supply_sag)
    sensed_pressure = laws.function(muscle_valves.sensed_pressure)

    def step(par, act, rates, length, speed, ctrl, time, timestep, place, valves, force):
        world, muscle = wp.tid()
        m = par[world, muscle]
        first = place[muscle, 0]
        named = first + place[muscle, 1] - _NAMED
        s, z = act[world, named : named + _NAMED], act[world, first:named]
        now = F(time[world])
        at = F(length[world, muscle])
        moving = F(speed[world, muscle])
        opposing = F(0.0)
        if m[_BACKLASH] > F(0.0) and m[_PARTNER] > F(0.0):
            other = int(m[_PARTNER]) - 1
            begin = place[other, 0]
            apart = begin + place[other, 1] - _NAMED
            opposing = tension(
                par[world, other],
                act[world, apart : apart + _NAMED],
                act[world, begin:apart],
                F(length[world, other]),
                F(speed[world, other]),
            )
        sag = F(0.0)
        if m[_RESISTANCE] + m[_SQUARE] > F(0.0):
            on_line = wp.int32(0)
            for fed in range(par.shape[1]):
                if par[world, fed, _SUPPLY_LINE] == m[_SUPPLY_LINE]:
                    begin = place[fed, 0]
                    apart = begin + place[fed, 1] - _NAMED
                    inside = chamber_pressure(
                        par[world, fed],
                        act[world, apart : apart + _NAMED],
                        act[world, begin:apart],
                        F(length[world, fed]),
                    )
                    fill_valve_of(
                        par[world, fed],
                        act[world, apart : apart + _NAMED],
                        inside,
                        F(ctrl[world, fed]),
                        now,
                        timestep,
                        valves[world, muscle, on_line],
                    )
                    on_line = on_line + 1
            sag = supply_sag(m, s, valves[world, muscle, 0:on_line], timestep)
        pull = state_rates(
            m,
            s,
            z,
            rates[world, named : named + _NAMED],
            rates[world, first:named],
            at,
            moving,
            F(ctrl[world, muscle]),
            now,
            timestep,
            opposing,
            sag,
        )
        # The engine's force lengthens the tendon; a muscle shortens it.
        force[world, muscle] = wp.float32(-tendon_force(m, s, pull, at, moving, timestep))

    def read(par, act, length, speed, place, pressure, pull):
        world, muscle = wp.tid()
        m = par[world, muscle]
        first = place[muscle, 0]
        named = first + place[muscle, 1] - _NAMED
        s, z = act[world, named : named + _NAMED], act[world, first:named]
        at = F(length[world, muscle])
        pressure[world, muscle] = sensed_pressure(m, s, z, at)
        pull[world, muscle] = tension(m, s, z, at, F(speed[world, muscle]))

    def advance(act, rates, time, timestep, tick, shown):
        world = wp.tid()
        for k in range(act.shape[1]):
            act[world, k] = act[world, k] + timestep * rates[world, k]
            shown[world, k] = wp.float32(act[world, k])
        time[world] = time[world] + tick

    rows, states = wp.array3d(dtype=F), wp.array2d(dtype=F)
    engine, times = wp.array2d(dtype=wp.float32), wp.array(dtype=wp.float64)
    places = wp.array2d(dtype=wp.int32)

    def made(function: Callable[..., None], *types: Any) -> Any:
        names = function.__code__.co_varnames[: function.__code__.co_argcount]
        function.__annotations__ = dict(zip(names, types, strict=True))
        return wp.kernel(function, module=laws.module, enable_backward=False)

    return MuscleKernels(
        step=made(
            step,
            rows,
            states,
            states,
            engine,
            engine,
            engine,
            times,
            F,
            places,
            wp.array4d(dtype=F),
            engine,
        ),
        read=made(read, rows, states, engine, engine, places, states, states),
        advance=made(advance, states, states, times, F, wp.float64, engine),
    )
