"""No muscle gives more work over a closed cycle of length and pressure than its air does.

Whatever the law, the operator and the cycle, the air's work, the integral of p dV, is at least the
muscle's, the integral of -F dl: the difference is what hysteresis loses. A cycle that comes out
negative would be a machine that makes energy.
"""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.physics.braid import Braid
from pamsim.physics.chain import Chain
from pamsim.physics.hysteresis.arctangent import Arctangent
from pamsim.physics.hysteresis.bouc_wen import BoucWen
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.hysteresis.fractional_maxwell import FractionalMaxwell
from pamsim.physics.hysteresis.group import Hysteresis
from pamsim.physics.hysteresis.maxwell_slip import MaxwellSlip
from pamsim.physics.hysteresis.prandtl_ishlinskii import PrandtlIshlinskii
from pamsim.physics.hysteresis.preisach import PleatedFactor, Preisach
from pamsim.physics.passive import Creep
from pamsim.physics.record import pack, state_size
from pamsim.physics.tension import EndShape, Threshold
from tests.unit.physics.flat import chamber_volume, gauge_pressure, muscle_hysteresis, static_muscle
from tests.unit.physics.muscles import FORCES, make

POINTS, FIGURES = 240, range(4)
GRID = ("preisach", "pleated_factor")
"""Operators whose output goes in steps."""
PER_PRESSURE = 1.5e-4
"""Width of the loops [N/Pa]: 60 N of half width at 4 bar, and none without pressure."""
BRAID = Braid(nominal_length=0.25, diameter=0.02, fibre_angle=0.5)
LOOPS: dict[str, Hysteresis] = {
    group.law: group
    for group in (
        BoucWen(yield_contraction=0.01, sigma=0.5, sharpness=1.0),
        MaxwellSlip(elements=4, full_slip=0.04, decay=0.7),
        PrandtlIshlinskii(elements=4, span=0.06, decay=1.4, linear_share=0.3),
        Preisach(levels=6, low_contraction=0.0, high_contraction=0.2, c=-0.4, d=0.2),
        PleatedFactor(levels=6, low_contraction=0.0, high_contraction=0.2),
        Arctangent(turning_points=8, low_contraction=0.0, high_contraction=0.2),
        FractionalMaxwell(branches=5, order=0.6, time_constant=0.2, span=0.05),
    )
}


@dataclass(frozen=True)
class Cycle:
    """A closed figure of contraction [-] and gauge pressure [Pa], its first point again last."""

    contraction: np.ndarray
    pressure: np.ndarray

    @property
    def length(self) -> np.ndarray:
        return BRAID.nominal_length * (1.0 - self.contraction)

    def lost(self, force: np.ndarray, volume: np.ndarray) -> float:
        """What the air does less what the muscle gives [J]."""
        return float(np.trapezoid(self.pressure, volume) + np.trapezoid(force, self.length))

    def swept(self, volume: np.ndarray) -> float:
        """Change of pressure times that of volume [J]: what its work is a part of."""
        return float(np.ptp(self.pressure) * np.ptp(volume))


@functools.cache
def cycle(number: int) -> Cycle:
    """Ellipses and Lissajous figures of random size, place, phase and sense.

    Small ones too, in which an operator hardly loses anything and what it holds comes to light.
    """
    draw = np.random.default_rng(100 + number)
    t = np.linspace(0.0, 2.0 * np.pi, POINTS + 1)
    first, second = ((1, 1), (1, 2), (2, 1), (1, 2), (2, 3))[number % 5]
    size, rise = (0.001, 0.01, 0.05)[number % 3], draw.uniform(0.5e5, 1.2e5)
    sense = (-1.0) ** (number // 2)
    kappa = draw.uniform(0.07, 0.1) + size * np.sin(first * t + draw.uniform(0.0, 6.0))
    pressure = draw.uniform(3.5e5, 4.5e5) + rise * np.sin(sense * second * t)
    return Cycle(kappa, pressure)


@functools.cache
def lossless(law: str, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Static force [N] and volume [m^3] along a cycle, with force lost to the ends."""
    # The force that counts from a working point goes below zero, where the ends take no share.
    ends = EndShape() if law in ("elastic_energy", "pleated_shape") else EndShape(loss=0.3)
    parts = {"threshold": Threshold(), "chain": Chain(), "creep": Creep(), "end_shape": ends}
    muscle, path = make(law, braid=BRAID, **parts), cycle(number)
    row = pack(muscle).tolist()
    tendons = path.length - muscle.mounting.length_at_zero
    points = list(zip(tendons.tolist(), path.pressure.tolist(), strict=True))
    force = [static_muscle.static_force(row, *point) for point in points]
    return np.array(force), np.array([static_muscle.static_volume(row, *point) for point in points])


@functools.cache
def remembered(loop: str, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Output and held energy of an operator along a cycle that it has been round before."""
    group, path, operator = LOOPS[loop], cycle(number).contraction.tolist(), OPERATORS[loop]
    act, rates = [0.0] * group.state_count, [0.0] * group.state_count
    timestep = 1.0 / POINTS
    for _ in range(4):
        output, held = [], []
        for x, after in zip(path, [*path[1:], path[1]], strict=True):
            output.append(operator.output(group, act, x))
            held.append(operator.energy(group, act, x))
            if len(output) <= POINTS:
                operator.rates(group, act, rates, x, (after - x) / timestep, timestep)
                act = [z + timestep * rate for z, rate in zip(act, rates, strict=True)]
    return np.array(output), np.array(held)


def by_memory(loop: str, number: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Force [N] and volume [m^3] of an operator along a cycle, and how wrong a sum may be [J].

    That is for an output on a grid: the trapezium rule is off by up to half a step at its jumps.
    """
    path, (output, held) = cycle(number), remembered(loop, number)
    force = -PER_PRESSURE * path.pressure * output
    volume = -PER_PRESSURE * BRAID.nominal_length * held
    if loop not in GRID:
        return force, volume, 0.0
    furthest = 0.5 * np.abs(np.diff(path.length)).max()
    return force, volume, furthest * float(np.abs(np.diff(force)).sum())


@pytest.mark.parametrize("law", FORCES)
def test_no_cycle_gives_energy_and_without_hysteresis_a_muscle_gives_what_its_air_does(law):
    for number in FIGURES:
        path, (static, still) = cycle(number), lossless(law, number)
        bound = 1e-4 * path.swept(still)
        assert path.lost(static, still) == pytest.approx(0.0, abs=bound + 1e-9), number
        for loop in LOOPS:
            force, volume, uncertain = by_memory(loop, number)
            quadrature = bound + 1e-4 * path.swept(volume) + 3e-5 + uncertain
            assert path.lost(static + force, still + volume) >= -quadrature, (loop, number)


def test_the_kernel_takes_volume_for_what_the_operator_holds():
    for loop, plain in LOOPS.items():
        group = dataclasses.replace(plain, force=7.0, force_per_pressure=PER_PRESSURE)
        this = make("six_parameter", hysteresis=group)
        row, memory = pack(this).tolist(), [0.01 * (k + 1) for k in range(group.state_count)]
        act = memory + [0.0] * (state_size(this) - group.state_count)
        tendon, kappa = 0.225 - 0.05, 1.0 - 0.225 / BRAID.nominal_length
        held = OPERATORS[loop].energy(group, act, kappa)
        extra = chamber_volume(row, act, tendon, 3e5)
        extra -= static_muscle.static_volume(row, tendon, 3e5)
        assert held != 0.0
        stored = -PER_PRESSURE * BRAID.nominal_length * held
        assert extra == pytest.approx(stored, rel=1e-9), loop


def chamber(row: list[float], data: mujoco.MjData, muscle: int) -> tuple[float, ...]:
    """Pressure, volume, hysteresis's part of it, its force, and shortening of a muscle [SI]."""
    size = len(data.act) // 2
    act = data.act[size * muscle : size * (muscle + 1)].tolist()
    tendon = float(data.actuator_length[muscle])
    pressure, kappa = gauge_pressure(row, act, tendon), static_muscle.contraction(row, tendon)
    static = static_muscle.static_force(row, tendon, pressure)
    return (
        pressure,
        chamber_volume(row, act, tendon, pressure),
        muscle_hysteresis.hysteresis_volume(row, act, kappa),
        muscle_hysteresis.hysteresis_force(row, act, kappa, pressure, static),
        -tendon,
    )


def test_the_arm_turns_the_work_of_its_air_into_heat_and_nothing_else():
    """Under two sines against each other: what the air does, damping and loops lose."""
    model = pamsim.load_rig("mas20_arm").model_for(command="pressure_set", load=1.2, timestep=1e-3)
    data = mujoco.MjData(model)
    rows = [model.actuator_user[i].tolist() for i in range(2)]
    joint, timestep, steps = model.joint("shaft"), model.opt.timestep, 1000
    damping, address = float(joint.damping[0]), joint.dofadr[0]
    speeds: list[float] = []
    seen: list[list[tuple[float, ...]]] = []
    pamsim.reset(model, data, (2.5e5, 2.5e5))
    with pamsim.live(model):
        for k in range(6 * steps + 1):
            swing = 1.2e5 * np.sin(2.0 * np.pi * k / steps)
            data.ctrl[:] = (2.5e5 + swing, 2.5e5 - swing)
            if k >= 5 * steps:  # the chambers' mean pressures have settled
                speeds.append(float(data.qvel[address]))
                if k % 8 == 0:
                    mujoco.mj_forward(model, data)
                    seen.append([chamber(row, data, i) for i, row in enumerate(rows)])
            mujoco.mj_step(model, data)
    done = lost = 0.0
    for pressure, volume, held, loop, shortening in np.array(seen).transpose(1, 2, 0):
        done += np.trapezoid(pressure, volume)
        lost += np.trapezoid(loop, shortening) + np.trapezoid(pressure, held)
    lost += damping * timestep * np.sum(np.square(speeds[:-1]))
    assert done == pytest.approx(lost, rel=0.02)
