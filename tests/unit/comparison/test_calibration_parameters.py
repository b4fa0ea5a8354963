"""What a calibration may move: names, ties, ranges in the file's unit, priors."""

from __future__ import annotations

import dataclasses

import pytest

import pamsim
from pamsim.comparison.free_parameters import FACTOR, default_names, freed_parameters
from pamsim.core.errors import InputError
from pamsim.core.parameters import Sourced


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("mas20_arm")


def stating(rig, group, field, **changes):
    """The rig with the entry of a muscle parameter changed."""
    entry = dataclasses.replace(rig.file.muscle[group][field], **changes)
    muscle = {**rig.file.muscle, group: {**rig.file.muscle[group], field: entry}}
    return dataclasses.replace(rig, file=dataclasses.replace(rig.file, muscle=muscle))


def test_a_positive_number_may_change_by_a_factor_and_is_searched_in_proportion(rig):
    (freed,) = freed_parameters(rig, ["valve.conductance_fill"])
    value = rig.muscles["muscle_1"].valve.conductance_fill
    assert freed.free.start == value
    assert (freed.free.low, freed.free.high) == (value / FACTOR, value * FACTOR)
    assert freed.free.scale == "log"
    assert freed.written(value) == pytest.approx(rig.file.muscle["valve"]["conductance_fill"].value)
    assert freed.written_unit == "dm^3/(s*bar)"


def test_no_range_leaves_what_the_law_allows(rig):
    (index,) = freed_parameters(rig, ["chamber.polytropic_index"])
    assert (index.free.low, index.free.high, index.free.scale) == (1.0, 1.4, "linear")
    (threshold,) = freed_parameters(rig, ["threshold.pressure"])  # neutral at 0
    assert threshold.free.low == threshold.free.start == 0.0
    assert threshold.range_source == "whole allowed range, because it is 0"


def test_a_number_of_either_sign_may_change_it(rig):
    (tilt,) = freed_parameters(rig, ["body.rig.tilt"])
    assert tilt.free.low < 0.0 < tilt.free.high
    assert tilt.free.scale == "linear"
    assert tilt.free.start - tilt.free.low == pytest.approx(tilt.free.high - tilt.free.start)


def test_bounds_of_the_file_and_of_the_user_count_in_this_order(rig):
    bounded = stating(rig, "chamber", "dead_volume", bounds=(8.0, 20.0))
    (from_file,) = freed_parameters(bounded, ["chamber.dead_volume"])
    assert (from_file.free.low, from_file.free.high) == pytest.approx((8e-6, 20e-6))
    assert from_file.range_source == "bounds of params.toml"
    (given,) = freed_parameters(
        bounded, ["chamber.dead_volume"], bounds={"chamber.dead_volume": ("5", "0.03dm^3")}
    )
    assert (given.free.low, given.free.high) == pytest.approx((5e-6, 30e-6))
    (in_si,) = freed_parameters(
        bounded, ["chamber.dead_volume"], bounds={"chamber.dead_volume": (5e-6, 30e-6)}
    )
    assert (in_si.free.low, in_si.free.high) == (5e-6, 30e-6)


def test_prior_is_the_stated_interval(rig):
    known = stating(rig, "chamber", "dead_volume", interval95=(8.0, 12.0))
    (freed,) = freed_parameters(known, ["chamber.dead_volume"], prior=True)
    assert freed.free.prior.mean == pytest.approx(10e-6)
    assert freed.free.prior.standard_deviation == pytest.approx(4e-6 / (2 * 1.96), rel=1e-3)
    (without,) = freed_parameters(known, ["chamber.dead_volume"])
    assert without.free.prior is None
    (unknown,) = freed_parameters(rig, ["force.scale"], prior=True)
    assert unknown.free.prior is None


def test_tied_names_take_one_number(rig):
    (freed,) = freed_parameters(rig, ["valve.conductance_fill = valve.conductance_exhaust"])
    assert freed.values(3e-10) == {
        "valve.conductance_fill": 3e-10,
        "valve.conductance_exhaust": 3e-10,
    }
    one, other = (
        rig.with_parameters(freed.values(3e-10)).muscles[name] for name in ("muscle_1", "muscle_2")
    )
    assert one.valve.conductance_exhaust == other.valve.conductance_fill == 3e-10


def test_one_muscle_and_native_fields_can_be_freed(rig):
    names = ["muscle_2:chamber.dead_volume", "joint.shaft.armature", "tendon.chain_1.coef"]
    bounds = {"joint.shaft.armature": (0.0, 0.01)}
    second, armature, sprocket = freed_parameters(rig, names, bounds=bounds)
    assert second.free.start == rig.muscles["muscle_2"].chamber.dead_volume
    assert armature.free.start == rig.model.joint("shaft").armature[0]
    assert sprocket.free.start == rig.file.native["tendon.chain_1.coef"].si("m")
    changed = rig.with_parameters(armature.values(0.004))
    assert changed.model.joint("shaft").armature[0] == 0.004


@pytest.mark.parametrize(
    ("wanted", "bounds", "words"),
    [
        (["passive.locking", "passive.locking"], {}, "is free already"),
        (["muscle_1:passive.locking", "passive.locking"], {}, "is free already"),
        (["muscle_3:passive.locking"], {}, "no muscle 'muscle_3'"),
        (["joint.shaft.armature"], {}, "give its range with `bounds`"),
        (["passive.locking"], {"passive.locking": ("10", "x")}, "not a number"),
        (["chamber.dead_volume"], {"chamber.dead_volume": ("5kg", "20")}, "does not measure"),
    ],
)
def test_bad_requests_are_refused(rig, wanted, bounds, words):
    with pytest.raises(InputError, match=words):
        freed_parameters(rig, wanted, bounds=bounds)


def test_default_frees_what_the_data_can_show(rig):
    moving, at_rest = (default_names(rig, moving=moving) for moving in (True, False))
    assert len(moving) == 8
    assert {"valve.conductance_exhaust", "joint.shaft.damping", "force.scale"} <= set(moving)
    assert not any(name.startswith("valve.") or name.endswith(".damping") for name in at_rest)
    for name in (*moving, *at_rest):  # each has a range without further ado
        (freed,) = freed_parameters(rig, [name])
        assert freed.free.low < freed.free.start < freed.free.high


def test_a_rig_that_states_nothing_usual_needs_names(rig):
    bare = dataclasses.replace(
        rig, file=dataclasses.replace(rig.file, muscle={}, native={}, sensor={})
    )
    with pytest.raises(InputError, match="name some with `free`"):
        default_names(bare, moving=True)


def test_what_the_file_calls_identified_is_open_again(rig):
    known = Sourced(value=0.01, unit="N*m", source="identified", where="test")
    native = {**rig.file.native, "joint.shaft.frictionloss": known}
    with_friction = dataclasses.replace(
        rig.with_parameters({"joint.shaft.frictionloss": 0.01}),
        file=dataclasses.replace(rig.file, native=native),
    )
    assert "joint.shaft.frictionloss" in default_names(with_friction, moving=False)
