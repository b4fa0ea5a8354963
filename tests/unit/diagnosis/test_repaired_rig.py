"""Every effect that can be named can be written into a rig and is read back as it was."""

from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest

import pamsim
from pamsim.comparison.effects_on_rig import at_size, candidate
from pamsim.comparison.readable_unit import readable, readable_unit
from pamsim.core.errors import InputError
from pamsim.diagnosis.fitted_rig import check_folder, repair, write_repaired_rig
from pamsim.effects.catalog import EFFECTS, TRIAL_EFFECTS
from pamsim.engine.parameters import rig_parameter

NUISANCE = {"force.scale": 1.0123456789, "chamber.dead_volume": 1.23456789e-5}


def repair_of(rig, effects):
    """A repair by some effects at 0.7 of their typical size, with all values and intervals."""
    found = [candidate(rig, EFFECTS[name]) for name in effects]
    sizes = {k: v for c in found for k, v in at_size(rig, c.effect, 0.7).items()}
    values = {**NUISANCE, **sizes}
    intervals = {n: (v - 0.1 * abs(v), v + 0.1 * abs(v)) for n, v in values.items()}
    effect_of = {p.name: c.name for c in found for p in c.parameters}
    return repair(rig, values, intervals, effect_of, "bench"), values, intervals


def test_a_repaired_rig_reads_back_as_the_repaired_model(rig, tmp_path):
    for effect in TRIAL_EFFECTS:
        one, values, _ = repair_of(rig, [effect])
        back = pamsim.load_rig(write_repaired_rig(one, tmp_path / effect, "Missing: something."))
        wanted = rig.with_parameters(values)
        for name, value in values.items():
            assert rig_parameter(back, name).value == pytest.approx(value, rel=1e-8), effect
        assert back.model.actuator_user == pytest.approx(wanted.model.actuator_user, rel=1e-8)
        assert astuple(back.sensor) == pytest.approx(astuple(wanted.sensor), rel=1e-8)
        for field in ("dof_damping", "dof_frictionloss", "dof_armature", "body_quat"):
            own, other = getattr(back.model, field), getattr(wanted.model, field)
            np.testing.assert_allclose(own, other, rtol=1e-8, err_msg=effect)


def test_every_repaired_number_says_where_it_is_from_and_how_far_it_is_known(rig, tmp_path):
    one, _, intervals = repair_of(rig, ["air_leak", "angle_bias", "coulomb_friction"])
    back = pamsim.load_rig(write_repaired_rig(one, tmp_path / "rig", "Missing: a leak.")).file
    entries = {
        "chamber.leak_conductance": (back.muscle["chamber"]["leak_conductance"], "air_leak"),
        "sensor.angle_bias": (back.sensor["angle_bias"], "angle_bias"),
        "joint.shaft.frictionloss": (back.native["joint.shaft.frictionloss"], "coulomb_friction"),
        "force.scale": (back.muscle["force"]["scale"], "refitted beside the named effects"),
    }
    for name, (entry, note) in entries.items():
        assert entry.source == "identified by pamsim diagnose from bench"
        assert entry.note == note
        low, high = intervals[name]
        unit = rig_parameter(rig, name).spec.unit
        scale = entry.si(unit) / entry.value
        assert entry.interval95 == pytest.approx((low / scale, high / scale), rel=1e-4)
    assert entries["chamber.leak_conductance"][0].unit == "mm^3/(s*kPa)"
    assert entries["chamber.leak_conductance"][0].value == pytest.approx(1.4)
    text = (tmp_path / "rig" / "params.toml").read_text(encoding="utf-8")
    assert text.startswith("# Written by pamsim diagnose from bench.\n# Missing: a leak.\n")


def test_one_muscle_of_its_own_keeps_the_shared_number_beside_it(rig, tmp_path):
    one, *_ = repair_of(rig, ["muscle_mismatch"])
    back = pamsim.load_rig(write_repaired_rig(one, tmp_path / "rig", ""))
    scales = [m.force.scale for m in back.muscles.values()]
    assert scales == pytest.approx([NUISANCE["force.scale"], 1.028])


def test_units_are_the_file_s_own_or_such_as_people_use(rig):
    for name, value, unit, written in (
        ("body.rig.tilt", np.pi / 180.0, "deg", 1.0),
        ("valve.conductance_fill", 4e-10, "dm^3/(s*bar)", 0.04),
        ("chamber.leak_conductance", 2e-12, "mm^3/(s*kPa)", 2.0),
        ("valve.supply_resistance", 2e8, "kPa*s/g", 200.0),
        ("chain.compliance", 1e-6, "mm/kN", 1.0),
        ("valve.delay", 0.01, "s", 0.01),
    ):
        parameter = rig_parameter(rig, name)
        assert readable_unit(parameter) == unit
        assert readable(parameter, value) == pytest.approx(written)


def test_a_folder_that_cannot_take_the_rig_is_refused_beforehand(rig, tmp_path):
    check_folder(tmp_path / "new", "mas20_arm")
    check_folder(tmp_path, None)
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="is a file"):
        check_folder(tmp_path / "file", None)
    folder = write_repaired_rig(repair_of(rig, ["air_leak"])[0], tmp_path / "rig", "")
    for out in (tmp_path, Path(folder)):
        with pytest.raises(InputError, match="the folder of the rig it is made from"):
            check_folder(out, str(folder))


def test_an_interval_that_is_not_known_is_not_written(rig):
    intervals = {"chain.compliance": (-np.inf, np.inf), "chain.backlash": (1e-4, 3e-4)}
    values = {"chain.compliance": 1e-6, "chain.backlash": 2e-4}
    numbers = repair(rig, values, intervals, {}, "bench").numbers
    assert numbers["chain.compliance"].interval95 is None
    assert numbers["chain.backlash"].interval95 == pytest.approx((0.1, 0.3))
