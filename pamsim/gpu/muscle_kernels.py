"""The muscles' step and gauges as Warp kernels: a thread for each muscle of each world.

The arguments of all kernels have these names, for n worlds of m muscles and numbers F of one
precision: ``par`` (n, m, SIZE) F; states ``act`` and their rates ``rates`` (n, na) F; ``length``,
``speed``, ``ctrl`` and ``force`` (n, m) of the engine, whose copy of the states is ``shown``
(n, na); ``time`` (n,) in double precision [s]; ``timestep`` F and ``tick`` in double precision [s];
``place`` (m, 2) of each muscle's first state and of its first with a name; ``valves``
(n, m, m, VALVE) F, scratch for the supplies, or (1, 1, 1, VALVE) without any; gauge ``pressure``
[Pa] and ``pull``, the tension [N], (n, m) F.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from pamsim.gpu.port import port, warp
from pamsim.physics import chamber_pressure as chamber
from pamsim.physics import kernel, muscle_valves, supply
from pamsim.physics.record import STATE_NAMES, slot

_PARTNER, _BACKLASH = slot("partner"), slot("chain.backlash")
_RESISTANCE, _SUPPLY_LINE = slot("valve.supply_resistance"), slot("valve.supply_line")
_SQUARE, _CROSS_LEAK = slot("valve.supply_square"), slot("chamber.cross_leak_conductance")
_NAMED = len(STATE_NAMES)


class MuscleKernels(NamedTuple):
    """Kernels, to be launched by `launch`."""

    step: Any  # of n worlds, m muscles: rates and forces at the start of a time step
    read: Any  # of n worlds, m muscles: pressures and tensions
    advance: Any  # of n worlds: an Euler step of the states and their copy, and of the time


def launch(compiled: Any, shape: Any, arrays: Mapping[str, Any], device: Any) -> None:
    """Run a kernel for each thread of a shape with the arguments that it asks for by name."""
    given = [arrays[argument.label] for argument in compiled.adj.args]
    warp().launch(compiled, dim=shape, inputs=given, device=device)


@functools.cache
def muscle_kernels(precision: str) -> MuscleKernels:
    """The kernels in a precision, compiled when they are first launched; errors as of `Port`."""
    wp, laws = warp(), port(precision)
    F = laws.scalar
    tension = laws.function(kernel.tension)
    chamber_pressure = laws.function(chamber.chamber_pressure)
    state_rates = laws.function(kernel.state_rates)
    tendon_force = laws.function(kernel.tendon_force)
    fill_valve_of = laws.function(supply.fill_valve_of)
    supply_sag = laws.function(supply.supply_sag)
    cross_flow = laws.function(muscle_valves.cross_flow)
    sensed_pressure = laws.function(muscle_valves.sensed_pressure)
    engine = wp.array2d(dtype=wp.float32)
    types = {
        "par": wp.array3d(dtype=F),
        **dict.fromkeys(("act", "rates", "pressure", "pull"), wp.array2d(dtype=F)),
        **dict.fromkeys(("length", "speed", "ctrl", "force", "shown"), engine),
        "time": wp.array(dtype=wp.float64),
        "timestep": F,
        "tick": wp.float64,
        "place": wp.array2d(dtype=wp.int32),
        "valves": wp.array4d(dtype=F),
        **dict.fromkeys(("world", "muscle"), wp.int32),
    }

    def typed(function: Callable[..., Any]) -> Callable[..., Any]:
        names = function.__code__.co_varnames[: function.__code__.co_argcount]
        function.__annotations__ = {name: types[name] for name in names}
        return function

    def states(act, place, world, muscle):
        named = place[muscle, 1]
        return act[world, named : named + _NAMED], act[world, place[muscle, 0] : named]

    states = wp.func(typed(states), module=laws.module)

    def step(par, act, rates, length, speed, ctrl, time, timestep, place, valves, force):
        world, muscle = wp.tid()
        m = par[world, muscle]
        s, z = states(act, place, world, muscle)
        ds, dz = states(rates, place, world, muscle)
        now, at, moving = F(time[world]), F(length[world, muscle]), F(speed[world, muscle])
        opposing, crossing = F(0.0), F(0.0)
        if m[_PARTNER] > F(0.0):
            other = int(m[_PARTNER]) - 1
            beside = par[world, other]
            s2, z2 = states(act, place, world, other)
            pulled, apart = F(length[world, other]), F(speed[world, other])
            if m[_BACKLASH] > F(0.0):
                opposing = tension(beside, s2, z2, pulled, apart)
            if m[_CROSS_LEAK] + beside[_CROSS_LEAK] > F(0.0):
                own = chamber_pressure(m, s, z, at)
                crossing = cross_flow(m, beside, own, chamber_pressure(beside, s2, z2, pulled))
        sag = F(0.0)
        if m[_RESISTANCE] + m[_SQUARE] > F(0.0):
            on_line = wp.int32(0)
            for i in range(par.shape[1]):
                fed = par[world, i]
                if fed[_SUPPLY_LINE] == m[_SUPPLY_LINE]:
                    si, zi = states(act, place, world, i)
                    inside = chamber_pressure(fed, si, zi, F(length[world, i]))
                    sent, valve = F(ctrl[world, i]), valves[world, muscle, on_line]
                    fill_valve_of(fed, si, inside, sent, now, timestep, valve)
                    on_line = on_line + 1
            sag = supply_sag(m, s, valves[world, muscle, 0:on_line], timestep)
        sent = F(ctrl[world, muscle])
        pull = state_rates(
            m, s, z, ds, dz, at, moving, sent, now, timestep, opposing, sag, crossing
        )
        # The engine's force lengthens the tendon; a muscle shortens it.
        force[world, muscle] = wp.float32(-tendon_force(m, s, pull, at, moving, timestep))

    def read(par, act, length, speed, place, pressure, pull):
        world, muscle = wp.tid()
        m, at = par[world, muscle], F(length[world, muscle])
        s, z = states(act, place, world, muscle)
        pressure[world, muscle] = sensed_pressure(m, s, z, at)
        pull[world, muscle] = tension(m, s, z, at, F(speed[world, muscle]))

    def advance(act, rates, time, timestep, tick, shown):
        world = wp.tid()
        for k in range(act.shape[1]):
            act[world, k] = act[world, k] + timestep * rates[world, k]
            shown[world, k] = wp.float32(act[world, k])
        time[world] = time[world] + tick

    return MuscleKernels(
        *(
            wp.kernel(typed(function), module=laws.module, enable_backward=False)
            for function in (step, read, advance)
        )
    )
