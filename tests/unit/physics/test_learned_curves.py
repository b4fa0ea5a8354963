"""Learned curves: splines of their control values, and the work of a learned tension."""

import dataclasses

import numpy as np
import pytest

import pamsim
from pamsim.physics.chain import CONTROLS as ARMS
from pamsim.physics.chain import Chain, chain_length, chain_ratio
from pamsim.physics.friction import Friction
from pamsim.physics.learned import LENGTH, RUB, SPEED, Learned, learned_force, learns
from pamsim.physics.learned_tension import (
    CONTROLS,
    LearnedTension,
    learned_area,
    learned_derivatives,
    learned_gain,
    learned_pull,
    learned_work,
    learns_tension,
)
from pamsim.physics.record import pack, view
from pamsim.physics.spline import curve_of_8, shares
from pamsim.physics.static_muscle import static_force, static_volume, volume_and_slope, work_ratio
from tests.unit.physics.flat import kernel
from tests.unit.physics.muscles import charged, make
from tests.unit.physics.splines import by_scipy

RNG = np.random.default_rng(4)
FORCES, DRAGS = RNG.normal(size=LENGTH) * 20.0, RNG.normal(size=SPEED) * 5.0
RUBS, SHARES = np.abs(RNG.normal(size=RUB)) * 5.0, RNG.normal(size=ARMS) * 0.1
AREAS, PULLS = RNG.normal(size=CONTROLS) * 2e-5, RNG.normal(size=CONTROLS) * 20.0


def numbered(**curves):
    return {f"{n}_{k}": float(c) for n, curve in curves.items() for k, c in enumerate(curve, 1)}


def test_a_curve_is_the_sum_of_its_control_values_by_their_shares():
    for count in (8, 24):
        control, x = RNG.normal(size=count), np.linspace(-0.2, 0.3, 41)
        of_each = shares(x, -0.2, 0.3, count)
        assert of_each @ control == pytest.approx(by_scipy(control, (-0.2, 0.3), x), abs=1e-12)
        assert of_each.sum(axis=1) == pytest.approx(1.0)
        (beyond,) = shares(np.array([9.0]), -0.2, 0.3, count)
        assert beyond @ control == pytest.approx(control[-1])
    control = RNG.normal(size=8)
    for x in (-0.9, -0.2, -0.11, 0.0, 0.123, 0.3, 0.9):
        (of_each,) = shares(np.array([x]), -0.2, 0.3, 8)
        assert curve_of_8(x, -0.2, 0.3, *control) == pytest.approx(of_each @ control, abs=1e-12)


def learned(forces=FORCES, drags=DRAGS):
    numbers = numbered(force=forces, drag=drags)
    return Learned(low=0.16, high=0.2, slowest=-0.1, fastest=0.15, **numbers)


def test_a_learned_force_is_scipy_s_splines_and_stays_at_their_ends():
    for x in np.linspace(0.16, 0.2, 23):
        alone = learned_force(learned(drags=np.zeros(SPEED)), float(x), 0.3)
        assert alone == pytest.approx(by_scipy(FORCES, (0.16, 0.2), x), abs=1e-9)
    for v in np.linspace(-0.1, 0.15, 23):
        alone = learned_force(learned(forces=np.zeros(LENGTH)), 0.17, float(v))
        assert alone == pytest.approx(by_scipy(DRAGS, (-0.1, 0.15), v), abs=1e-9)
    assert learned_force(learned(), 0.0, 9.0) == pytest.approx(FORCES[0] + DRAGS[-1])
    assert learned_force(learned(), 0.3, -9.0) == pytest.approx(FORCES[-1] + DRAGS[0])


def test_without_ends_there_is_no_curve():
    assert not learns(Learned())
    assert learned_force(Learned(force_3=10.0, drag_3=10.0), 0.18, 0.1) == 0.0
    assert learns(Learned(low=0.1, high=0.2))
    assert learns(Learned(slowest=-0.1, fastest=0.1))
    assert learned_force(Learned(rub_3=10.0), 0.18, 0.1) == 0.0
    assert learns(Learned(rub_low=0.1, rub_high=0.2))
    assert chain_length(Chain(learned_3=0.1), 0.18) == 0.18
    assert chain_ratio(Chain(learned_3=0.1), 0.18) == 1.0
    assert not learns_tension(LearnedTension(area_3=1e-5))
    assert learns_tension(LearnedTension(low=-0.1, high=0.1))


def test_a_learned_dry_friction_is_against_the_motion_and_full_above_its_speed():
    friction = Learned(rub_low=0.16, rub_high=0.2, rub_speed=2e-3, **numbered(rub=RUBS))
    for x in np.linspace(0.15, 0.21, 23).tolist():
        full = float(by_scipy(RUBS, (0.16, 0.2), np.clip(x, 0.16, 0.2)))
        assert learned_force(friction, x, 1.0) == pytest.approx(full)
        assert learned_force(friction, x, -1.0) == pytest.approx(-full)
        assert learned_force(friction, x, 2e-3) == pytest.approx(full * np.tanh(1.0))
        assert learned_force(friction, x, 0.0) == 0.0


BRAKING = {"rub_low": 0.16, "rub_high": 0.2, "rub_speed": 2e-3, "slowest": -0.1, "fastest": 0.15}


def test_a_curve_that_brakes_takes_work_at_every_length_and_speed():
    """So does every cycle of it. Curves that may drive are left as they are."""
    drove = 0
    for _ in range(500):
        own = numbered(drag=RNG.normal(size=SPEED), rub=RNG.normal(size=RUB))
        free, braking = (Learned(**BRAKING, **own, brakes=one) for one in (0.0, 1.0))
        for x, v in zip(RNG.uniform(0.15, 0.21, 5), RNG.uniform(-0.2, 0.2, 5), strict=True):
            force, parts = (
                learned_force(braking, x, v),
                [
                    learned_force(dataclasses.replace(free, **none), x, v)
                    for none in ({"fastest": -0.1}, {"rub_high": 0.16})
                ],
            )
            assert force * v >= 0.0
            assert force == pytest.approx(sum(part for part in parts if part * v > 0.0))
            assert learned_force(free, x, v) == pytest.approx(sum(parts))
            drove += sum(parts) * v < 0.0
    assert drove > 100


CAM = Chain(learned_low=-0.01, learned_high=0.012, **numbered(learned=SHARES))


def test_a_learned_arm_is_scipy_s_splines_and_its_travel_the_integral():
    for x in np.linspace(-0.02, 0.02, 41).tolist():
        share = float(by_scipy(SHARES, (-0.01, 0.012), np.clip(x, -0.01, 0.012)))
        assert chain_ratio(CAM, x) == pytest.approx(1.0 + share)
        near = chain_length(CAM, x + 1e-7) - chain_length(CAM, x - 1e-7)
        assert near / 2e-7 == pytest.approx(1.0 + share, abs=1e-5)
    assert chain_length(CAM, 0.0) == 0.0


def test_a_cam_loses_no_work_between_muscle_and_tendon():
    """The tendon's force times its speed is the muscle's times its own."""
    muscle = make("six_parameter", chain=CAM, friction=Friction())
    row, act = pack(muscle).tolist(), charged(muscle, 0.19, 3e5)
    for x in (0.19, 0.192, 0.2):
        pull, ratio = kernel.tension(row, act, x), chain_ratio(CAM, x)
        assert pull > 10.0
        assert abs(ratio - 1.0) > 0.01
        outside = kernel.tendon_force(row, act, pull, x, 0.0, 5e-4)
        assert outside == pytest.approx(ratio * pull, rel=1e-9)


ENDS = (-0.02, 0.12)
TENSION = LearnedTension(low=ENDS[0], high=ENDS[1], **numbered(area=AREAS, pull=PULLS))


def test_a_learned_tension_is_scipy_s_splines_and_stays_at_their_ends():
    for kappa in np.linspace(*ENDS, 23).tolist():
        area, pull = (by_scipy(curve, ENDS, kappa) for curve in (AREAS, PULLS))
        assert learned_area(TENSION, kappa) == pytest.approx(area, abs=1e-15)
        assert learned_pull(TENSION, kappa) == pytest.approx(pull, abs=1e-9)
    assert learned_area(TENSION, -0.3) == pytest.approx(AREAS[0])
    assert learned_pull(TENSION, 0.3) == pytest.approx(PULLS[-1])


def test_integrals_and_derivatives_are_those_of_the_curves():
    step = 1e-5
    for kappa in np.linspace(-0.1, 0.2, 31).tolist():
        gained, worked, pulled = (
            (curve(TENSION, kappa + step) - curve(TENSION, kappa - step)) / (2.0 * step)
            for curve in (learned_gain, learned_work, learned_pull)
        )
        assert gained == pytest.approx(learned_area(TENSION, kappa), abs=1e-8)
        assert worked == pytest.approx(learned_pull(TENSION, kappa), abs=1e-2)
        if -0.019 < kappa < 0.119:  # at the ends they bend
            assert learned_derivatives(TENSION, kappa)[1] == pytest.approx(
                pulled, rel=1e-2, abs=1.0
            )
    assert learned_gain(TENSION, 0.0) == 0.0


@pytest.mark.parametrize("extensibility", [0.0, 2e-8])
def test_force_and_volume_do_the_same_work(extensibility):
    """Virtual work: dV/dl = -dF/dp, at every length and pressure."""
    values = {f"learned_tension.{name}": value for name, value in vars(TENSION).items()}
    rig = pamsim.load_rig("mas20_arm").with_parameters({"braid.extensibility": extensibility})
    without = view(rig.model.actuator_user[0])
    m = view(rig.with_parameters(values).model.actuator_user[0])
    free = m.braid.nominal_length * (1.0 + extensibility * 2e5)
    for kappa in np.linspace(-0.05, 0.2, 11).tolist():
        length = (1.0 - kappa) * m.braid.nominal_length - m.mounting.length_at_zero
        force = [static_force(m, length, p) for p in (2e5 - 10.0, 2e5 + 10.0)]
        space = [static_volume(m, at, 2e5) for at in (length - 1e-6, length + 1e-6)]
        assert np.diff(force)[0] / 20.0 == pytest.approx(-np.diff(space)[0] / 2e-6, rel=1e-6)
        strained = 1.0 - (length + m.mounting.length_at_zero) / free
        more = static_force(m, length, 2e5) - static_force(without, length, 2e5)
        expected = 2e5 * learned_area(TENSION, strained) + learned_pull(TENSION, strained)
        assert more == pytest.approx(expected)
    assert work_ratio(m, 3e5, 0.04) == pytest.approx(1.0, rel=1e-5)
    for kappa in (-0.01, 0.03, 0.1):
        low, high = (volume_and_slope(m, kappa, p)[0] for p in (2e5 - 50.0, 2e5 + 50.0))
        slope = volume_and_slope(m, kappa, 2e5)[1]
        assert slope == pytest.approx((high - low) / 100.0, rel=1e-3, abs=1e-16)
