"""Diagnoses of data other than commanded recordings: rests, measured pressures, machines, logs."""

import dataclasses
import json
import math

import numpy as np
import pytest

import pamsim
from pamsim.comparison.rest_simulator import RestPredictor
from pamsim.core.errors import InputError
from pamsim.diagnosis import recordings
from pamsim.diagnosis.fitted_rig import PULLEY, possible_rig
from pamsim.diagnosis.options import Options
from pamsim.diagnosis.table_at_rest import diagnose_table, published_rig
from pamsim.engine.parameters import rig_parameter
from pamsim.physics.chain import learns_arm
from pamsim.recordings.static_table import read_static_table
from pamsim.report.link_page import write_link_diagnosis
from pamsim.twins.hide import hide
from tests.plant.hidden.catalog import PLANT_EFFECTS
from tests.plant.hidden.hidden_effect import PlantEffect, on_joint, on_muscles
from tests.plant.hidden.sensor_effects import periodic_error
from tests.plant.hide import hide as hide_in_plant

TILT = -0.12


def coarse(rig):
    """A rig of longer steps, for synthetic data and fit."""
    rig.model.opt.timestep = 1e-3
    return rig


@pytest.fixture(scope="module")
def arm():
    return coarse(pamsim.load_rig("mas20_arm"))


@pytest.fixture(scope="module")
def published():
    rig = published_rig()
    rig.model.opt.timestep = 2e-3
    return rig


@pytest.fixture(scope="module")
def table(published):
    """The loaded and some unloaded printed rows, with a tilted shaft hidden in them."""
    printed = read_static_table("mas20")
    keep = np.flatnonzero(np.abs(printed.angle) < 0.5)[-12:]
    table = dataclasses.replace(
        printed,
        name="synthetic",
        rows=tuple(printed.rows[i] for i in keep),
        pressure=printed.pressure[keep],
        load=printed.load[keep],
        angle=printed.angle[keep],
    )
    tilted = published.with_parameters({"body.rig.tilt": TILT})
    ends = RestPredictor(lambda _: None, table).simulated(tilted)
    noise = 2e-3 * np.random.default_rng(1).standard_normal(ends.size)
    return dataclasses.replace(table, angle=ends + noise)


@pytest.fixture(scope="module")
def report(published, table):
    tried = ("load_torque", "muscle_hysteresis", "viscous_friction", "passive_stiffness")
    return diagnose_table(table, published, Options(effects=tried))


def test_what_is_hidden_in_a_table_at_rest_is_named_with_its_size(report, tmp_path):
    found = json.loads(json.dumps(report.to_dict(), allow_nan=False))
    assert (found["schema"], found["verdict"]) == ("pamsim-diagnosis/3", "named")
    (effect,) = found["effects"]
    assert effect["name"] == "load_torque"
    low, high = effect["sizes"]["body.rig.tilt"]["interval95_si"]
    assert low < TILT < high
    gap = found["gap"]["angle_at_rest"]
    assert gap["after"] < 0.3 < gap["before"]
    off = np.array([[row["before_deg"], row["after_deg"]] for row in found["rows"]])
    assert np.sqrt(np.mean(off**2, axis=0)) == pytest.approx([gap["before"], gap["after"]])
    assert "no repeats" in " ".join(found["warnings"])
    assert report.summary().startswith("Certain: ")
    skipped = report.run.skipped
    assert "path" in skipped["muscle_hysteresis"]
    assert skipped["viscous_friction"] == "moves no angle at rest"
    assert "passive_stiffness" not in skipped  # a form that hardens needs no tube of the rig's own
    page = write_link_diagnosis(found, report.comparisons, tmp_path)
    assert report.summary() in page.read_text(encoding="utf-8")
    assert (tmp_path / "rows.png").exists()


def test_the_repaired_rig_simulates_what_was_fitted(published, table, report):
    (effect,), (pulley,) = report.effects, report.nuisance
    values = {name: size.value_si for name, size in effect.sizes.items()}
    radius = pulley.whole * 1e-3
    repaired = possible_rig(published, values | {PULLEY: radius})
    off = RestPredictor(lambda _: repaired, table).simulated(repaired) - table.angle
    # In the fit itself each row is off by less than where a fit to the others leaves it.
    assert np.degrees(np.sqrt(np.mean(off**2))) < report.gap["angle_at_rest"].after
    for tendon in ("chain_1", "chain_2"):
        assert rig_parameter(repaired, f"tendon.{tendon}.coef").value == pytest.approx(radius)


def test_the_published_rig_is_the_first_rung_of_the_calibration(published):
    table = read_static_table("mas20")
    ends = RestPredictor(lambda _: None, table).simulated(published)
    recorded = json.loads((published.file.folder / "calibration.json").read_text(encoding="utf-8"))
    rms = np.degrees(np.sqrt(np.mean((ends - table.angle) ** 2)))
    assert rms == pytest.approx(recorded["static_models"][0]["rms_deg"], abs=2e-3)
    one = dataclasses.replace(table, pressure=table.pressure[:, :1])
    for other, options, words in (
        (one, Options(), "is of 1 muscles"),
        (table, Options(effects=("load_torq",)), "did you mean 'load_torque'"),
    ):
        with pytest.raises(InputError, match=words):
            diagnose_table(other, published, options)


def test_measured_pressures_drive_a_rig_whose_commands_are_unknown(arm, tmp_path):
    settings = {"protocols": ("multisine",), "duration": 1.0, "repeats": 5, "seed": 3}
    for name, effects in (("none", {}), ("two", {"viscous_friction": 1.5, "air_leak": 3.0})):
        hidden = hide(arm, effects, **settings, measured_drive=True)
        hidden.save(tmp_path / name)
        tried = ("viscous_friction", "air_leak", "valve_delay")
        found = pamsim.diagnose(tmp_path / name, rig=arm, effects=tried)
        assert [one.name for one in found.effects] == (["viscous_friction"] if effects else [])
        assert found.verdict.value == ("named" if effects else "no_gap")
    # What valves do is not claimed to be seen.
    assert "valves and air" not in {one.link for one in found.links}
    (volume,) = (one for one in found.nuisance if one.parameter == "chamber.dead_volume")
    assert volume.by_link == {}
    assert any("valves, air and supply" in warning for warning in found.warnings)
    header = next((tmp_path / "two").glob("multisine*_1.csv")).read_text().splitlines()[0]
    assert ("p1_kpa" in header, "set" in header) == (True, False)
    for trial in pamsim.read_recordings(tmp_path / "two").trials:
        assert trial.drive == "measured"
        pressure = hidden.trials[trial.name].pressure
        np.testing.assert_allclose(trial.command, pressure, rtol=0, atol=1.0)  # in steps of 1 Pa


@pytest.mark.slow
def test_hysteresis_is_named_from_the_force_under_an_imposed_length(tmp_path):
    """The force of the machine alone, as where no cell sits beside the muscle."""
    rig, settings = coarse(pamsim.load_rig("muscle_bench")), {"duration": 1.0, "repeats": 5}
    effects = {"muscle_hysteresis": 1.5}
    stretched = hide(rig, effects, protocols=("stretch",), forces=False, seed=2, **settings)
    stretched.save(tmp_path / "data")
    result = pamsim.diagnose(tmp_path / "data", rig=rig, effects=["muscle_hysteresis", "air_leak"])
    (effect,) = result.effects
    assert effect.name == "muscle_hysteresis"
    assert "muscle and joint" in effect.links
    gap = result.gap["rod.force"]
    assert gap.after < 0.3 * gap.before


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.3, 0.0])
def test_a_stop_that_has_no_name_is_learned_and_written_into_a_rig(size, tmp_path, monkeypatch):
    """In typical sizes of 4 N m/rad, from 8 deg on; nothing is learned where nothing is missing."""
    hidden = hide_in_plant(
        "mas20_arm", {"soft_stop": size} if size else {}, duration=5.0, repeats=3, forces=False,
        protocols=("triangle", "staircase", "multisine"), formulation="plant", seed=3, step=7e-4,
    )  # fmt: skip
    hidden.save(tmp_path / "data")
    report = pamsim.diagnose(tmp_path / "data", rig="mas20_arm", effects=["muscle_mismatch"])
    assert ("Without a name" in report.sentence) == bool(size)
    if not size:
        assert report.learned == ()
        return
    (curve,) = report.learned
    assert (curve.kind, curve.acts_at) == ("a torque over the position", "shaft")
    assert curve.resembles == "stop"
    assert curve.before > 2.5
    assert curve.after < 1.15
    stiffness = 4.0 * size * math.pi / 180.0
    assert curve.numbers["begin"] == pytest.approx(8.0, abs=2.0)
    assert curve.numbers["stiffness"] == pytest.approx(stiffness, rel=0.25)
    true, visited = -stiffness * np.maximum(curve.at - 8.0, 0.0), np.abs(curve.at) < 25.0
    assert np.sqrt(np.mean((curve.value - true)[visited] ** 2)) < 0.1 * np.abs(true).max()
    report.save(tmp_path / "out")
    learned = pamsim.load_rig(tmp_path / "out" / "rig").muscles["muscle_1"].learned
    assert learned.high > learned.low
    gap = report.gap["angle"]
    assert gap.after < 0.5 * gap.before
    # A curve with which the whole chain misses more is left out.
    monkeypatch.setattr(recordings, "misses_more", lambda gap: gap["angle"].after is not None)
    report = pamsim.diagnose(tmp_path / "data", rig="mas20_arm", effects=["muscle_mismatch"])
    assert report.learned == ()
    assert report.repair is None
    assert any("misses more (RMS): it is left out" in one for one in report.warnings)


LOOPS = ("triangle", "staircase", "multisine")


def with_curves(folder, monkeypatch, unnamed, protocols=LOOPS, *, forces=False, seed):
    """What is learned of an effect that no library has; its report, curves and repaired rig."""
    monkeypatch.setitem(PLANT_EFFECTS, unnamed.name, unnamed)
    hidden = hide_in_plant(
        "mas20_arm", {unnamed.name: 1.0}, duration=5.0, repeats=3, forces=forces,
        protocols=protocols, formulation="plant", seed=seed, step=7e-4,
    )  # fmt: skip
    hidden.save(folder / "data")
    report = pamsim.diagnose(folder / "data", rig="mas20_arm", effects=["muscle_mismatch"])
    report.save(folder / "out")
    return report, report.learned, pamsim.load_rig(folder / "out" / "rig")


@pytest.mark.slow
def test_an_error_of_the_sensor_is_learned_and_written_into_a_rig(tmp_path, monkeypatch):
    """The encoder sits on a gear off its axis: four periods per turn of the joint."""
    off_axis = PlantEffect(
        name="off_axis", formulation="an eccentric gear", unit="rad", typical=0.01,
        sensed=lambda run, size: run.with_angle(run.angle + periodic_error(run.angle, size, 4.0)),
    )  # fmt: skip
    report, (curve,), rig = with_curves(tmp_path, monkeypatch, off_axis, seed=5)
    assert (curve.kind, curve.acts_at) == ("an error of the sensor over the position", "shaft")
    assert (curve.at_unit, curve.unit) == ("deg", "deg")
    assert curve.after < 1.15 < 2.0 < curve.before
    true = np.degrees(periodic_error(np.radians(curve.at), 0.01, 4.0))
    visited = np.abs(curve.at) < 20.0
    assert np.sqrt(np.mean((curve.value - true)[visited] ** 2)) < 0.15 * np.abs(true).max()
    assert rig.sensor.learns
    gap = report.gap["angle"]
    assert gap.after < 0.5 * gap.before


@pytest.mark.slow
def test_a_flow_that_grows_less_and_less_is_learned_over_the_opening(tmp_path, monkeypatch):
    """Poppets whose flow hardly grows beyond 60 % of their lift; the model's is proportional."""
    poppet = PlantEffect(
        name="poppet", formulation="a poppet valve", unit="1", typical=0.6,
        change=on_muscles("lift"),
    )  # fmt: skip
    report, (curve,), rig = with_curves(
        tmp_path, monkeypatch, poppet, ("pulses", "bursts", "levels"), seed=3
    )
    assert curve.kind == "a change of the flow over the opening"
    assert (curve.acts_at, curve.at_unit, curve.unit) == ("the valves", "%", "%")
    share = np.abs(curve.at) / 100.0
    true = 100.0 * (np.tanh(share / 0.6) / np.tanh(1.0 / 0.6) / share - 1.0)
    seen = share > 0.3  # what pulses open
    assert np.sqrt(np.mean((curve.value - true)[seen] ** 2)) < 0.2 * np.abs(true).max()
    assert curve.after - 1.0 < 0.2 * (curve.before - 1.0)
    again = rig.muscles["muscle_2"].valve
    assert again.learned_high > again.learned_low
    gap = report.gap["pressure_1"]
    assert gap.after < 0.5 * gap.before


@pytest.mark.slow
def test_a_tension_that_no_law_has_is_learned_with_its_volume(tmp_path, monkeypatch):
    """A further area of 0.8 cm^2 at a contraction of 1 %, which pressures show as forces do."""
    swelling = PlantEffect(
        name="swelling", formulation="a bump over the contraction", unit="m^2", typical=8e-5,
        change=on_muscles("swell", swell_at=0.01, swell_width=0.015),
    )  # fmt: skip
    report, (curve,), rig = with_curves(tmp_path, monkeypatch, swelling, forces=True, seed=1)
    assert (curve.kind, curve.unit) == ("a tension per pressure over the contraction", "N/bar")
    assert curve.resembles == "bump"
    assert curve.numbers == pytest.approx({"height": 8.0, "middle": 1.0, "width": 3.0}, rel=0.15)
    assert curve.before > 3.0
    assert curve.after < 1.1
    again = rig.muscles["muscle_2"].learned_tension
    assert again.high > again.low
    gap = report.gap["pressure_1"]
    assert gap.after < gap.before
    result = json.loads((tmp_path / "out" / "diagnosis.json").read_text(encoding="utf-8"))
    page = write_link_diagnosis(result, report.comparisons, tmp_path / "out")
    assert "over the contraction of the muscles" in page.read_text(encoding="utf-8")


DURATION = 28.0
KNOTS = {
    0: 0.0, 2: 2.0, 4: -2.0, 5: -2.0, 8: 3.0, 11: -3.0, 12: -3.0, 14: 1.0, 16: -1.0, 18: 1.0,
    19: 1.0, 22: 3.0, 25: -1.5, 28: 0.0,
}  # fmt: skip


def motor_torque(time):
    """Slow swings of several sizes, holds among them [N m]."""
    return np.interp(time, list(KNOTS), list(KNOTS.values()))


class Turned:
    """Turns the joint by a motor, against friction of Dahl's kind unless its level is 0.

    The friction is no formula of the library: its steps are made here, between those of the engine.
    """

    gives_in = 0.004  # angle in which it builds up [rad]

    def __init__(self, level):
        self.level, self.friction = level, 0.0

    def __call__(self, model, data):
        moved = float(data.qvel[0]) * model.opt.timestep
        if self.level > 0.0:
            # df/dq = (level / x)(1 - f sign(q') / level), integrated over the step.
            limit = math.copysign(self.level, moved)
            share = math.exp(-abs(moved) / self.gives_in)
            self.friction = limit + (self.friction - limit) * share
        data.qfrc_applied[0] = float(motor_torque(max(data.time, 0.0))) - self.friction


@pytest.mark.slow
@pytest.mark.parametrize("level", [0.25, 0.0])
def test_friction_of_another_formula_is_found_in_one_log_of_a_sealed_joint(level, arm, tmp_path):
    """A motor turns it against two sealed muscles, in a lab's own words and units."""
    still = pamsim.Experiment(
        drive="valve",
        command_time=np.array([0.0]),
        command_value=np.zeros((1, 2)),
        start_pressure=np.array([2.5e5, 2.5e5]),
        duration=DURATION,
        sample_rate=25.0,
    )
    run = pamsim.simulate(arm, still, each_step=Turned(level)).completed()
    noise = np.random.default_rng(5).standard_normal((3, run.time.size))
    columns = {
        "t [s]": run.time,
        "phi [deg]": np.degrees(run.angle) + 0.05 * noise[0],
        "p left [kPa]": 1e-3 * run.pressure[:, 0] + 0.3 * noise[1],
        "p right [kPa]": 1e-3 * run.pressure[:, 1] + 0.3 * noise[2],
        "motor torque [Nm]": motor_torque(run.time),
    }
    table, log = np.column_stack(list(columns.values())), tmp_path / "run.csv"
    np.savetxt(log, table, "%.6g", ",", comments="", header=",".join(columns))
    pamsim.import_log(
        log,
        rig=arm,
        out=tmp_path / "data",
        drive="muscle_1=sealed,muscle_2=sealed,shaft=torque",
        columns=["muscle_1.pressure=p left [kPa]", "muscle_2.pressure=p right [kPa]"],
    )
    friction = {"coulomb_friction", "viscous_friction", "stribeck_friction"}
    tried = sorted(friction | {"load_torque", "angle_lag"})
    nuisance = ("force.scale", "chamber.dead_volume")
    found = pamsim.diagnose(tmp_path / "data", rig=arm, effects=tried, nuisance=nuisance)
    named = {effect.name for effect in found.effects}
    assert named <= friction, found.sentence
    assert bool(named) == (level > 0.0), found.sentence


@pytest.mark.slow
def test_a_dry_friction_about_one_position_is_learned_and_brakes_only(tmp_path, monkeypatch):
    """A worn place of the joint, 0.25 N m at 4 deg; friction that is the same everywhere is not."""
    worn = PlantEffect(
        name="worn", formulation="dry friction about 4 deg", unit="N*m", typical=0.25,
        change=on_joint("patch", patch_at=0.07, patch_width=0.12, patch_speed=0.05),
    )  # fmt: skip
    report, (curve,), rig = with_curves(tmp_path, monkeypatch, worn, seed=6)
    assert (curve.kind, curve.acts_at) == ("a dry friction over the position", "shaft")
    assert "passive" in curve.holds
    true = 0.25 * np.exp(-0.5 * ((np.radians(curve.at) - 0.07) / 0.12) ** 2)
    visited = np.abs(curve.at) < 15.0
    assert np.sqrt(np.mean((curve.value - true)[visited] ** 2)) < 0.1 * true.max()
    assert curve.after - 1.0 < 0.1 * (curve.before - 1.0)
    assert rig.muscles["muscle_1"].learned.brakes == 1.0
    gap = report.gap["angle"]
    assert gap.after < 0.5 * gap.before


@pytest.mark.slow
def test_a_cam_is_learned_as_an_arm_of_each_muscle(tmp_path, monkeypatch):
    """A pulley whose arm is 12 % longer about 4 deg; load cells read the muscles' forces."""
    cam = PlantEffect(
        name="bulge", formulation="a cam", unit="1", typical=0.12,
        change=on_muscles("cam", cam_at=0.07, cam_width=0.15),
    )  # fmt: skip
    report, curves, rig = with_curves(tmp_path, monkeypatch, cam, forces=True, seed=7)
    assert [curve.acts_at for curve in curves] == ["muscle_1", "muscle_2"]
    for curve in curves:
        assert curve.kind == "a change of the moment arm over the position"
        assert (curve.at_unit, curve.unit) == ("deg", "%")
        true = 12.0 * np.exp(-0.5 * ((np.radians(curve.at) - 0.07) / 0.15) ** 2)
        visited = np.abs(curve.at) < 15.0
        assert np.sqrt(np.mean((curve.value - true)[visited] ** 2)) < 1.2
        assert curve.after - 1.0 < 0.1 * (curve.before - 1.0)
    assert all(learns_arm(muscle.chain) for muscle in rig.muscles.values())
    assert report.gap["angle"].after < report.gap["angle"].before
