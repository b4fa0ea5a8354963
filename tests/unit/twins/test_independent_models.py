"""Laws of the independent models against what is known of them in closed form."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.actuator.layout import SIZE, slot
from pamsim.pneumatics.air import GAS_CONSTANT
from pamsim.twins.independent_models import (
    command,
    joint,
    measurement,
    muscle,
    pneumatic,
    transmission,
)
from pamsim.twins.independent_models.outside_effects import SmoothTorque

DT = 2.5e-4


def wander(steps: int, size: float, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    path = np.cumsum(rng.standard_normal(steps))
    return size * (path - path[0]) / np.abs(path - path[0]).max()


@pytest.mark.parametrize("speed", [0.01, -0.3, 2.0])
def test_lugre_slides_at_the_level_of_its_stribeck_curve(speed):
    friction = joint.LuGre(0.4, 0.25, 0.3)
    found = 0.0
    for _ in range(round(40 * 2e-3 / abs(speed) / DT)):
        found = friction.torque(speed, DT)
    level = 0.25 + 0.15 * math.exp(-((speed / 0.3) ** 2))
    assert found == pytest.approx(-math.copysign(level, speed), rel=1e-3)


def test_lugre_sticks_like_a_spring_before_it_slides():
    friction = joint.LuGre(0.3, 0.3)
    speed = 2e-4 / 0.5  # a tenth of the deflection at which it slips
    for _ in range(round(0.5 / DT)):
        friction.torque(speed, DT)
    held = friction.torque(0.0, DT)
    assert held == pytest.approx(-0.3 * 0.1, rel=0.06)
    for _ in range(round(0.5 / DT)):
        friction.torque(-speed, DT)
    assert abs(friction.torque(0.0, DT)) < 0.01 * 0.3


@pytest.mark.parametrize("seed", range(4))
def test_lugre_gives_no_energy(seed):
    friction = joint.LuGre(0.4, 0.2, 0.2)
    speeds = wander(20000, 1.0, seed)
    taken = -np.cumsum([friction.torque(v, DT) * v * DT for v in speeds.tolist()])
    assert taken.min() > -1e-9
    assert taken[-1] > 0.0


def cycle(bank, amplitude, cycles=3, points=2000):
    path = amplitude * np.sin(np.linspace(0.0, 2.0 * math.pi * cycles, points * cycles + 1))
    out = np.array([bank.output(0, x) for x in path.tolist()])
    return path, out


@pytest.mark.parametrize("amplitude", [1.5e-3, 6e-3, 0.02])
def test_a_maxwell_slip_loop_is_closed_and_as_wide_as_its_blocks_say(amplitude):
    path, out = cycle(muscle.MaxwellSlipBank(1.0), amplitude)
    last, before = slice(-2001, None), slice(-4001, -2000)
    np.testing.assert_allclose(out[last], out[before], atol=1e-12)
    area = np.trapezoid(out[last], path[last])
    parts = zip(muscle._SHARES, muscle._SLIPS, strict=True)
    known = sum(4.0 * share * max(amplitude - slip, 0.0) for share, slip in parts)
    assert area == pytest.approx(known, rel=2e-3)
    assert sum(muscle._SHARES) == pytest.approx(1.0)
    if amplitude > 2.0 * max(muscle._SLIPS):
        assert out.max() == pytest.approx(1.0)


@pytest.mark.parametrize("seed", range(3))
def test_a_maxwell_slip_bank_gives_no_energy_at_a_constant_pressure(seed):
    bank = muscle.MaxwellSlipBank(1.0)
    path = wander(5000, 0.015, seed)
    out = np.array([bank.output(0, x) for x in path.tolist()])
    assert np.cumsum(out[1:] * np.diff(path)).min() > -1e-9


def test_maxwell_slip_force_is_in_proportion_to_pressure_and_against_contraction():
    for pressure in (1e5, 4e5, -2e4):
        plant = SimpleNamespace(
            muscles=[0], pull=[0.0], pressure=lambda i, p=pressure: p, contraction=lambda i: 0.0
        )
        bank = muscle.MaxwellSlipBank(2e-4)
        bank(plant)
        plant.contraction = lambda i: 0.05
        bank(plant)
        assert plant.pull[0] == pytest.approx(-2e-4 * max(pressure, 0.0))


def test_a_held_contraction_relaxes_in_two_times():
    creep = muscle.TwoBranchCreep(2000.0)
    creep.pull(0, 0.0, DT)
    times = DT * np.arange(16000)
    found = np.array([creep.pull(0, 0.02, DT) for _ in times])
    known = -40.0 * sum(share * np.exp(-times / time) for share, time in muscle._BRANCHES)
    np.testing.assert_allclose(found, known, atol=0.02)


def test_static_curves_are_smooth_forms_of_the_library_s():
    pressures = np.linspace(0.0, 1e6, 400)
    lost = np.array([muscle.smooth_threshold(p, 2e4) for p in pressures])
    assert lost[0] == 0.0
    assert np.all(np.diff(lost) > 0.0)
    assert lost[-1] == pytest.approx(2e4, rel=1e-5)
    assert np.all(lost <= pressures)
    stretch = np.linspace(-0.03, 0.03, 61)
    spring = np.array([muscle.cubic_spring(x, 3e3) for x in stretch])
    np.testing.assert_allclose(spring, -spring[::-1], atol=1e-12)
    assert np.gradient(spring, stretch)[30] == pytest.approx(3e3, rel=1e-2)
    share = np.array([muscle.cone_loss(x, 0.4, 0.01) for x in np.linspace(-0.05, 0.3, 400)])
    assert np.all(np.diff(share) > 0.0)
    assert 0.0 < share[0] < 1e-3
    assert muscle.cone_loss(0.2, 0.4, 0.01) == pytest.approx(2.0 * 0.4 * 0.19, rel=1e-3)
    assert muscle.cone_loss(3.0, 0.4, 0.01) == 1.0
    assert transmission.hardening_compliance(700.0, 1e-6) == pytest.approx(1e-6)
    stretched = [
        t * transmission.hardening_compliance(t, 1e-6) for t in (0.0, 350.0, 700.0, 1400.0)
    ]
    slopes = np.diff(stretched) / np.diff([0.0, 350.0, 700.0, 1400.0])
    assert np.all(np.diff(slopes) < 0.0)
    assert np.all(slopes > 0.0)


def test_elastic_teeth_give_way_on_both_sides_in_proportion_to_what_presses():
    gaps = [transmission.elastic_gap(pull, 3e-4) for pull in (0.0, 40.0, -40.0, 80.0)]
    assert gaps[0] == 3e-4
    assert gaps[1] == gaps[2] == pytest.approx(3e-4 + 2.0 * 40.0 / transmission._TOOTH)
    assert gaps[3] - gaps[0] == pytest.approx(2.0 * (gaps[1] - gaps[0]))


def test_a_reservoir_falls_by_resistance_times_flow_in_its_own_time():
    flow, resistance = 2e-4, 2e8
    store = pneumatic.Reservoir(resistance, 6e5, 293.15)
    time = resistance * 1e-4 / (GAS_CONSTANT * 293.15)
    found = []
    for _ in range(round(4.0 * time / DT)):
        store.draw(flow, DT)
        found.append(store.pressure)
    times = DT * np.arange(1, len(found) + 1)
    known = 6e5 - resistance * flow * (1.0 - np.exp(-times / time))
    np.testing.assert_allclose(found, known, atol=2e-3 * resistance * flow)


class Shut:
    """A shut muscle whose volume is changed from outside."""

    def __init__(self):
        row = [0.0] * SIZE
        row[slot("chamber.temperature")] = 293.15
        row[slot("chamber.polytropic_index")] = 1.3
        self.rows, self.muscles = [row], [0]
        self.settling, self.timestep = False, 1e-3
        self.space, self.state = 8e-5, 3.5e5 ** (1.0 / 1.3) * 8e-5

    def volume(self, i):
        return self.space

    def air(self, i):
        return self.state

    def set_air(self, i, air_state):
        self.state = air_state

    def pressure_abs(self, i):
        return (self.state / self.space) ** 1.3


def test_squeezed_air_goes_to_where_the_walls_temperature_has_it():
    shut, exchange = Shut(), pneumatic.HeatExchange(2.0)
    exchange(shut)
    shut.space *= 0.9
    assert shut.pressure_abs(0) == pytest.approx(3.5e5 * 0.9**-1.3)
    found = []
    for _ in range(4000):
        found.append(shut.pressure_abs(0))
        exchange(shut)
    above = np.array(found) - 3.5e5 / 0.9
    times = 1e-3 * np.arange(4000)
    np.testing.assert_allclose(above, above[0] * np.exp(-2.0 * times), atol=0.03 * above[0])
    assert abs(above[-1]) < 1e-3 * above[0]


def test_air_let_in_counts_as_air():
    """Double the mass at one volume, slowly: the pressure in the end is double too."""
    shut, exchange = Shut(), pneumatic.HeatExchange(2.0)
    exchange(shut)
    heat = GAS_CONSTANT * 293.15
    mass = 3.5e5 * 8e-5 / heat
    for k in range(8000):
        if k < 4000:
            pressure = shut.pressure_abs(0)
            flow = mass / 4.0
            shut.state *= 1.0 + heat * flow * 1e-3 / (pressure * shut.space)
        exchange(shut)
    assert shut.pressure_abs(0) == pytest.approx(7e5, rel=2e-3)


def test_the_bus_delivers_every_command_once_within_its_jitter():
    mean = 0.012
    late = []
    for phase in (0.0, 0.31, 0.77):
        bus = command.SampledBus(mean, phase, [0.0])
        times = DT * np.arange(24000)
        sent = np.floor(times / 0.05 + 1e-9) + 1.0
        received = [bus.received(t, [u])[0] for t, u in zip(times.tolist(), sent, strict=True)]
        changes = np.flatnonzero(np.diff([0.0, *received]))
        values = np.array(received)[changes]
        assert values.tolist() == list(range(1, len(values) + 1))
        late += (times[changes] - 0.05 * (values - 1.0)).tolist()
    assert min(late) > 0.7 * mean - DT
    assert max(late) < 1.3 * mean + 2 * DT
    assert np.mean(late) == pytest.approx(mean, rel=0.05)
    assert np.std(late) > 0.1 * mean


def test_two_lags_answer_a_step_as_the_closed_form():
    lags, half = command.TwoLags(0.04, [1.0]), 0.02
    times = DT * np.arange(1, 1001)
    found = np.array([lags.output([3.0], DT)[0] for _ in times])
    known = 3.0 - 2.0 * (1.0 + times / half) * np.exp(-times / half)
    np.testing.assert_allclose(found, known, atol=0.02)


def test_the_smooth_dead_zone_is_odd_whole_and_nearly_shut_inside():
    openings = np.linspace(-1.0, 1.0, 401)
    found = np.array([command.smooth_dead_zone(u, 0.1) for u in openings])
    np.testing.assert_allclose(found, -found[::-1], atol=1e-15)
    assert (found[0], found[200], found[-1]) == pytest.approx((-1.0, 0.0, 1.0))
    assert np.all(np.diff(found) > 0.0)
    assert command.smooth_dead_zone(0.05, 0.1) < 0.01
    assert command.smooth_dead_zone(0.6, 0.1) == pytest.approx(0.5 / 0.9, rel=0.01)


def test_a_ramp_comes_late_by_the_whole_lag_and_the_rest_of_a_sensor_is_nearly_the_library_s():
    time = np.arange(400) / 100.0
    measured = measurement.two_lags(time, time, 0.1)
    np.testing.assert_allclose(measured[150:], time[150:] - 0.1, atol=1e-6)
    angle = np.linspace(-0.5, 0.5, 11)
    assert measurement.eccentric_bias(angle, 0.01)[5] == pytest.approx(0.01)
    assert np.ptp(measurement.eccentric_bias(angle, 0.01)) < 0.3 * 0.01
    np.testing.assert_allclose(measurement.bent_scale(angle, 0.03), 0.03 * angle, atol=0.3 * 0.015)
    pressure = np.linspace(0.0, 6e5, 7)
    assert np.ptp(measurement.drifting_bias(pressure, 3e3)) < 0.6 * 3e3
    assert np.all(np.diff(measurement.saturating_scale(pressure, 0.02)) > 0.0)


def test_a_smooth_torque_has_its_size_and_no_corners():
    points = np.random.default_rng(0).uniform(-1.0, 1.0, (400, 4)) * (0.6, 1.0, 2e5, 2e5)
    found = np.array(
        [
            [
                SmoothTorque(0.2, np.random.default_rng(s)).torque(a, b, 2e5 + c, 2e5 + d)
                for s in range(20)
            ]
            for a, b, c, d in points.tolist()
        ]
    )
    assert np.sqrt(np.mean(found**2)) == pytest.approx(0.2, rel=0.1)
    one = SmoothTorque(0.2, np.random.default_rng(1))
    line = np.array([one.torque(a, 0.0, 2e5, 2e5) for a in np.linspace(-0.5, 0.5, 1001)])
    assert np.abs(np.diff(line, 2)).max() < 1e-5
