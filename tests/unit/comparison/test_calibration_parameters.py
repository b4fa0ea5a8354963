"""What a calibration may move: names, ties, ranges in the file's unit, priors, ends of ranges."""

from __future__ import annotations

import dataclasses

import pytest

from pamsim.comparison.candidate import INSIDE, Candidate, inside
from pamsim.comparison.free_parameters import (
    FACTOR,
    default_names,
    first_names,
    freed_parameters,
    rig_values,
)
from pamsim.core.errors import InputError
from pamsim.core.parameters import Sourced
from pamsim.effects.effect import Effect, EffectParameter
from pamsim.engine.rig import load_rig
from pamsim.inference.free_parameter import FreeParameter


def stating(rig, group, field, **changes):
    """The rig with the entry of a muscle parameter changed."""
    entry = dataclasses.replace(rig.file.muscle[group][field], **changes)
    muscle = {**rig.file.muscle, group: {**rig.file.muscle[group], field: entry}}
    return dataclasses.replace(rig, file=dataclasses.replace(rig.file, muscle=muscle))


def of(rig, name, **options):
    (freed,) = freed_parameters(rig, [name], **options)
    return freed


def test_a_range_is_a_factor_unless_law_or_sign_ends_or_widens_it(rig):
    fill = of(rig, "valve.conductance_fill")
    value = rig.muscles["muscle_1"].valve.conductance_fill
    assert fill.free.start == value
    assert (fill.free.low, fill.free.high) == (value / FACTOR, value * FACTOR)
    assert fill.free.scale == "log"
    assert fill.written(value) == pytest.approx(rig.file.muscle["valve"]["conductance_fill"].value)
    assert fill.written_unit == "dm^3/(s*bar)"
    index = of(rig, "chamber.polytropic_index").free
    assert (index.low, index.high, index.scale) == (1.0, 1.4, "linear")
    threshold = of(rig, "threshold.pressure")  # neutral at 0
    assert threshold.free.low == threshold.free.start == 0.0
    assert threshold.range_source == "whole allowed range, because it is 0"
    tilt = of(rig, "body.rig.tilt").free
    assert tilt.low < 0.0 < tilt.high
    assert tilt.scale == "linear"
    assert tilt.start - tilt.low == pytest.approx(tilt.high - tilt.start)


def test_bounds_of_the_file_and_of_the_user_count_in_this_order(rig):
    name = "chamber.dead_volume"
    bounded = stating(rig, "chamber", "dead_volume", bounds=(8.0, 20.0))
    from_file = of(bounded, name)
    assert (from_file.free.low, from_file.free.high) == pytest.approx((8e-6, 20e-6))
    assert from_file.range_source == "bounds of params.toml"
    for bounds in (("5", "0.03dm^3"), (5e-6, 30e-6)):
        given = of(bounded, name, bounds={name: bounds}).free
        assert (given.low, given.high) == pytest.approx((5e-6, 30e-6))


def test_prior_is_the_stated_interval(rig):
    known = stating(rig, "chamber", "dead_volume", interval95=(8.0, 12.0))
    prior = of(known, "chamber.dead_volume", prior=True).free.prior
    assert prior.mean == pytest.approx(10e-6)
    assert prior.standard_deviation == pytest.approx(4e-6 / (2 * 1.96), rel=1e-3)
    assert of(known, "chamber.dead_volume").free.prior is None
    assert of(rig, "force.scale", prior=True).free.prior is None


def test_tied_names_one_muscle_and_native_fields_can_be_freed(rig):
    freed = of(rig, "valve.conductance_fill = valve.conductance_exhaust")
    assert rig_values([freed], [3e-10]) == {
        "valve.conductance_fill": 3e-10,
        "valve.conductance_exhaust": 3e-10,
    }
    names = ["muscle_2:chamber.dead_volume", "joint.shaft.armature", "tendon.chain_1.coef"]
    bounds = {"joint.shaft.armature": (0.0, 0.01)}
    second, armature, sprocket = freed_parameters(rig, names, bounds=bounds)
    assert second.free.start == rig.muscles["muscle_2"].chamber.dead_volume
    assert armature.free.start == rig.model.joint("shaft").armature[0]
    assert sprocket.free.start == rig.file.native["tendon.chain_1.coef"].si("m")
    changed = rig.with_parameters(rig_values([armature], [0.004]))
    assert changed.model.joint("shaft").armature[0] == 0.004


def test_bad_requests_are_refused(rig):
    flows = ("valve.conductance_fill", "valve.conductance_exhaust")
    for wanted, bounds, words in (
        (["passive.locking", "passive.locking"], {}, "is free already"),
        (["muscle_1:passive.locking", "passive.locking"], {}, "is free already"),
        (["muscle_3:passive.locking"], {}, "no muscle 'muscle_3'"),
        (["=".join(flows)], dict.fromkeys(flows, (1e-10, 1e-8)), "one number has one range"),
        (["joint.shaft.armature"], {}, "give one with `bounds`"),
        (["passive.locking"], {"passive.locking": ("10", "x")}, "not a number"),
        (["chamber.dead_volume"], {"chamber.dead_volume": ("5kg", "20")}, "does not measure"),
    ):
        with pytest.raises(InputError, match=words):
            freed_parameters(rig, wanted, bounds=bounds)
    bare = dataclasses.replace(
        rig, file=dataclasses.replace(rig.file, muscle={}, native={}, sensor={})
    )
    with pytest.raises(InputError, match="name some with `free`"):
        default_names(bare, moving=True)


def test_default_frees_what_the_data_can_show_and_what_the_file_calls_identified(rig):
    moving, at_rest = (default_names(rig, moving=moving) for moving in (True, False))
    assert len(moving) == 8
    assert {"valve.conductance_exhaust", "joint.shaft.damping", "force.scale"} <= set(moving)
    assert not any(name.startswith("valve.") or name.endswith(".damping") for name in at_rest)
    for name in (*moving, *at_rest):  # each has a range without further ado
        free = of(rig, name).free
        assert free.low < free.start < free.high
    known = Sourced(value=0.01, unit="N*m", source="identified", where="test")
    native = {**rig.file.native, "joint.shaft.frictionloss": known}
    with_friction = dataclasses.replace(
        rig.with_parameters({"joint.shaft.frictionloss": 0.01}),
        file=dataclasses.replace(rig.file, native=native),
    )
    assert "joint.shaft.frictionloss" in default_names(with_friction, moving=False)


def test_a_value_keeps_a_share_of_the_range_from_both_ends():
    parameter = FreeParameter(name="x", unit="N", start=2.0, low=1.0, high=3.0)
    for value, moved in ((1.0, 1.0 + 2.0 * INSIDE), (9.0, 3.0 - 2.0 * INSIDE), (2.0, 2.0)):
        assert inside([parameter], {"x": value})["x"] == pytest.approx(moved, rel=1e-12)


def test_an_end_counts_unless_it_is_neutral_zero_or_natural() -> None:
    stated = (
        EffectParameter("size", 1.0, 0.0, 4.0),
        EffectParameter("shape", 1.0, 0.5, 2.0, shape=True),
        EffectParameter("natural", 1.0, 0.5, 2.0, shape=True, natural_ends=True),
    )
    effect = Effect(
        name="x", family="x", missing="x", parameters=stated, look_alikes=(), separating="x"
    )
    own = tuple(
        FreeParameter(name=one.name, unit="N", start=1.0, low=one.low, high=one.high)
        for one in stated
    )
    found = Candidate(effect=effect, parameters=own, neutral={"size": 0.0}, probes=())
    inner = {"size": 1.0, "shape": 1.0, "natural": 1.0}
    assert not found.at_end(inner)
    assert not found.at_end(inner | {"size": 0.0})
    assert not found.at_end(inner | {"natural": 2.0})
    assert found.at_end(inner | {"size": 3.99})
    assert found.at_end(inner | {"shape": 0.5})
    assert not found.at_end(inner | {"shape": 0.52})


def test_far_off_files_free_each_length_friction_and_the_air(rig):
    arm = freed_parameters(rig, first_names(rig))
    lengths = [f.free for f in arm if f.name.endswith(":mounting.length_at_zero")]
    # Within a quarter of the nominal length either way.
    assert [(f.start, f.low, f.high) for f in lengths] == [(0.25, 0.1875, 0.3125)] * 2
    friction = next(f for f in arm if f.name == "joint.shaft.frictionloss")
    assert (friction.free.start, friction.free.low, friction.free.high) == (0.0, 0.0, 5.0)
    braid = {k: v for k, v in rig.file.muscle["braid"].items() if k != "nominal_length"}
    size = {"braid": {"nominal_length": rig.file.muscle["braid"]["nominal_length"]}}
    file = dataclasses.replace(
        rig.file,
        muscle={**rig.file.muscle, "braid": braid},
        overrides=dict.fromkeys(rig.muscles, size),  # each muscle states its own
    )
    each = dataclasses.replace(rig, file=file)
    assert first_names(each) == first_names(rig)
    assert of(each, "muscle_2:mounting.length_at_zero").free == arm[1].free
    bellows = first_names(load_rig("equimus_leg"))
    assert "joint.hip.damping" in bellows
    assert not any("length_at_zero" in name for name in bellows)
