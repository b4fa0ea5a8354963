"""What rows at rest are searched for on a rig, and what is refitted with every effect."""

import pytest

import pamsim
from pamsim.comparison.free_parameters import freed_parameters
from pamsim.core.errors import InputError
from pamsim.diagnosis.fitted_rig import PULLEY, pulleys, stated, with_fitted
from pamsim.diagnosis.options import NUISANCE, usual_nuisance
from pamsim.diagnosis.table_at_rest import candidates_at_rest, published_rig
from pamsim.engine.parameters import rig_parameter

RIG = published_rig()


def test_what_rows_at_rest_cannot_show_is_left_out_with_the_reason():
    tried, skipped = candidates_at_rest(RIG, (), {"body.rig.tilt"})
    names = {one.name for one in tried}
    assert {"braid_locking", "braid_extensibility", "angle_scale"} <= names
    assert not names & skipped.keys()
    assert "depends on the path" in skipped["coulomb_friction"]
    assert "measured" in skipped["air_leak"]
    assert "nuisance" in skipped["load_torque"]


def test_signatures_are_taken_where_an_effect_is_fully_there():
    tried, _ = candidates_at_rest(RIG, ("braid_locking", "end_shape"), ())
    locking, end_shape = tried
    (probe,) = locking.probes
    assert probe.values == {"passive.locking": 30.0, "passive.stiffness": 900.0}
    shapes = [p.shape for p in end_shape.probes]
    assert len(shapes) == len(set(shapes)) == 3
    assert len({p.values["end_shape.onset"] for p in end_shape.probes}) == 3


def test_a_number_that_is_0_is_no_usual_nuisance_parameter():
    rig = pamsim.load_rig("mas20_arm")
    unlocked = rig.with_parameters({"passive.locking": 0.0})
    assert set(usual_nuisance(rig)) - set(usual_nuisance(unlocked)) == {"passive.locking"}


def test_every_template_has_its_nuisance_parameters(tmp_path):
    for kind in ("joint", "leg", "bench", "bellows"):
        rig = pamsim.load_rig(pamsim.new_rig("own", kind, out=tmp_path / kind))
        names = usual_nuisance(rig)
        left_out = {"passive.locking"} if kind == "bellows" else set()
        assert set(NUISANCE) - set(names) == left_out
        assert [freed.name for freed in freed_parameters(rig, names)] == list(names)


def test_pulleys_that_differ_keep_their_ratio_and_a_rig_without_any_has_no_radius():
    with pytest.raises(InputError, match="states no pulley"):
        stated(pamsim.load_rig("equimus_leg"), PULLEY)
    first, second = pulleys(RIG)
    radius = stated(RIG, PULLEY).value
    uneven = RIG.with_parameters({second: 0.9 * radius})
    for factor in (1.0, 1.5):
        refitted = with_fitted(uneven, {PULLEY: factor * radius})
        assert rig_parameter(refitted, first).value == factor * radius
        assert rig_parameter(refitted, second).value == pytest.approx(0.9 * factor * radius)
