"""A rig beside its recordings: what coarse steps, measured pressures and the menu make of it."""

from __future__ import annotations

import numpy as np
import pytest

import pamsim
from pamsim.comparison.measurements import read_calibration_data
from pamsim.comparison.noise_floor import noise_floor
from pamsim.comparison.protocols import PROTOCOLS
from pamsim.comparison.trial_residuals import TrialSimulator
from pamsim.diagnosis.diagnosed_rig import DiagnosedRig
from pamsim.diagnosis.experiment_menu import MENU
from pamsim.diagnosis.measured_pressures import cells_with_measured_pressures
from pamsim.recordings.recording import write_recording
from pamsim.twins.hide import hide

SETTINGS = {"protocols": ("triangle",), "duration": 2.0, "repeats": 3, "seed": 2}


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm")


def recorded(rig, effects, folder, settings=SETTINGS):
    data = hide(rig, dict(effects), **settings)
    write_recording(folder, "mas20_arm", data.trials, data.protocols)
    return read_calibration_data([folder])


def test_coarse_steps_are_right_once_corrected(rig, tmp_path):
    """Within three hundredths of the noise where damping and force are others."""
    data = recorded(rig, [], tmp_path)
    simulator = TrialSimulator(DiagnosedRig(rig, data, ["triangle_check_1"]).residuals)
    first = simulator.anchor({})
    floor = noise_floor(simulator.layout, first)
    weights = simulator.layout.weights(floor.sd)
    np.testing.assert_allclose(simulator.whole({}), first, rtol=0, atol=1e-9 * np.abs(first).max())
    other = {"joint.shaft.damping": 0.27, "force.scale": 0.99}
    off = (simulator.whole(other) - simulator.fine(other)) * weights
    trials = len({p.block.trial for p in simulator.layout.places})
    channels = len(simulator.layout.channels)
    assert np.sum(off**2) / (trials * channels) < 1e-3


def test_sensors_that_read_otherwise_take_no_simulation(rig, tmp_path):
    data = recorded(rig, [], tmp_path)
    engine = DiagnosedRig(rig, data, [])
    before = engine.rollouts
    engine.residuals([{}], held_out=True, fine=False)
    one = engine.rollouts - before
    sets = [{}, {"sensor.angle_bias": 0.01}, {"sensor.angle_lag": 0.02}]
    blocks = engine.residuals(sets, held_out=True, fine=False)
    assert engine.rollouts - before == 2 * one
    for one, biased in zip(blocks[0], blocks[1], strict=True):
        if one.channel == "angle":  # starts that fit the trial best move it a little, too
            assert np.mean(biased.residual - one.residual) == pytest.approx(0.01, rel=0.1)


@pytest.mark.parametrize("fine", [False, True])
def test_where_a_fit_ended_only_the_held_out_trials_are_simulated(rig, tmp_path, fine):
    settings = SETTINGS | {"protocols": ("triangle", "bursts"), "duration": 0.5, "repeats": 1}
    data = recorded(rig, [], tmp_path, settings)
    held_out = [trial.name for trial in data.trials if trial.protocol == "bursts_check"]
    values = {"force.scale": 0.99}

    def counted(engine, **options):
        before = engine.rollouts
        (blocks,) = engine.residuals([values], fine=fine, **options)
        return engine.rollouts - before, [(b.trial, b.channel, b.residual.tolist()) for b in blocks]

    every, whole = counted(DiagnosedRig(rig, data, held_out), held_out=True)
    engine = DiagnosedRig(rig, data, held_out)
    first, fitted = counted(engine, held_out=False)
    rest, together = counted(engine, held_out=True)
    none, again = counted(engine, held_out=False)
    assert first + rest == every > first > rest > none == 0
    assert together == whole
    assert fitted == again == [block for block in whole if block[0] not in held_out]
    engine.residuals(
        [{"force.scale": 0.98 + 1e-4 * k} for k in range(40)], held_out=False, fine=fine
    )
    assert counted(engine, held_out=False) == (first, fitted)  # so many are not kept


@pytest.mark.parametrize("quantised", [True, False])
def test_an_encoder_that_counts_whole_increments_has_no_bias(rig, tmp_path, quantised):
    """It reads half an increment low: unknown to the prediction, that was an offset."""
    data = recorded(rig, [], tmp_path, SETTINGS | {"duration": 0.5, "quantised": quantised})
    (blocks,) = DiagnosedRig(rig, data, []).residuals([{}], held_out=True, fine=False)
    step = 2.0 * np.pi / rig.sensor.encoder_increments
    off = np.concatenate([b.residual for b in blocks if b.channel == "angle"])
    assert abs(np.mean(off)) < 0.1 * step
    assert np.std(off) > 0.1 * step  # the steps themselves stay, as noise


def test_measured_pressures_tell_arm_from_air(rig, tmp_path):
    """Friction at the joint shows in the angle whatever drives it; a wrong valve does not."""
    worst = {}
    for name, size in (("coulomb_friction", 0.4), ("valve_flow", 0.8)):
        settings = SETTINGS if name == "coulomb_friction" else {
            "protocols": ("bursts",), "duration": 2.0, "repeats": 3, "seed": 2
        }  # fmt: skip
        data = recorded(rig, [(name, size)], tmp_path / name, settings)
        simulator = TrialSimulator(DiagnosedRig(rig, data, []).residuals)
        residual = simulator.anchor({})
        floor = noise_floor(simulator.layout, residual)
        cells = cells_with_measured_pressures(rig, data, floor)
        assert {c.channel for c in cells} == {"angle", "force_1", "force_2"}
        given = max(c.excess for c in cells if c.channel == "angle")
        commanded = max(
            float(np.mean(residual[p.rows] ** 2)) / floor.variance["angle", p.block.protocol]
            for p in simulator.layout.places
            if p.block.channel == "angle"
        )
        worst[name] = given / commanded
    assert worst["coulomb_friction"] > 0.3
    assert worst["valve_flow"] < 0.1


@pytest.mark.parametrize(
    ("channels", "shown"), [(("angle", "pressure"), {"angle"}), (("pressure",), set())]
)
def test_measured_pressures_show_the_compared_channels_alone(rig, tmp_path, channels, shown):
    """A recording may hold forces that the diagnosis is asked not to compare."""
    data = recorded(rig, [], tmp_path, SETTINGS | {"duration": 0.5, "repeats": 2})
    assert "force_1" in data.trials[0].measured
    simulator = TrialSimulator(DiagnosedRig(rig, data, [], channels=channels).residuals)
    residual = simulator.anchor({})
    floor = noise_floor(simulator.layout, residual)
    cells = cells_with_measured_pressures(rig, data, floor)
    assert {cell.channel for cell in cells} == shown


def test_the_menu_is_safe_and_runs(rig, tmp_path):
    supply = next(iter(rig.muscles.values())).valve.supply_pressure
    for name, protocol in MENU.items():
        experiment = protocol.experiment(5)
        if experiment.drive == "pressure_set":
            assert experiment.command_value.min() >= 0.0, name
            assert experiment.command_value.max() < supply, name
    data = recorded(rig, [], tmp_path)
    engine = DiagnosedRig(rig, data, [])
    (found,) = engine.menu([{}])
    assert set(found) == set(MENU)
    assert all(np.all(np.isfinite(v)) for signals in found.values() for v in signals.values())


def test_a_rig_that_carries_no_load_is_offered_experiments_without_one(tmp_path):
    rig = pamsim.load_rig(pamsim.new_rig("arm", mjcf=unloaded(tmp_path), out=tmp_path / "arm"))
    made = hide(rig, {}, duration=1.0, repeats=1)
    assert set(made.protocols.values()) == {
        name + end for name, one in PROTOCOLS.items() if not one.load for end in ("", "_check")
    }
    write_recording(tmp_path / "data", "arm", made.trials, made.protocols)
    engine = DiagnosedRig(rig, read_calibration_data([tmp_path / "data"]), [])
    (found,) = engine.menu([{}])
    assert set(found) == {name for name, protocol in MENU.items() if not protocol.load}
    assert set(found) < set(MENU)


def unloaded(folder):
    """MJCF of one joint between two tendons, without a body for the load."""
    path = folder / "arm.xml"
    path.write_text(
        '<mujoco><worldbody><body><joint name="elbow" axis="0 0 1" range="-60 60"/>'
        '<geom size="0.02" mass="0.5" pos="0.1 0 0" contype="0" conaffinity="0"/></body>'
        '</worldbody><tendon><fixed name="flexor"><joint joint="elbow" coef="-0.025"/></fixed>'
        '<fixed name="extensor"><joint joint="elbow" coef="0.025"/></fixed></tendon></mujoco>',
        encoding="utf-8",
    )
    return path


def test_what_sets_muscles_apart_survives_the_variation_of_trials(rig):
    """Trials differ by their common scale; a hidden mismatch must be in every one of them."""
    moved = {}
    for variation in (0.0, 0.003):
        settings = {
            "protocols": ("triangle",),
            "duration": 0.5,
            "repeats": 2,
            "noise": 0.0,
            "variation": variation,
        }
        plain = hide(rig, {}, **settings)
        apart = hide(rig, {"muscle_mismatch": 1.0}, **settings)
        moved[variation] = [
            run.angle[0] - plain.trials[stem].angle[0] for stem, run in apart.trials.items()
        ]
    assert np.min(np.abs(moved[0.0])) > 1e-3
    np.testing.assert_allclose(moved[0.003], moved[0.0], rtol=0.1)
