"""Every force law and every operator of the catalogs runs on the arm, through params.toml alone."""

import re
import shutil
import sys
from dataclasses import replace

import numpy as np
import pytest

import pamsim
from pamsim.core.errors import EngineError
from pamsim.core.parameters import specs
from pamsim.physics.chosen_law import OF_LAW, OF_OPERATOR, law_functions, operator_functions
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.record import pack
from pamsim.recordings.rig_file import shipped_rigs
from tests.unit.physics.flat import static_muscle

# Numbers of the right size for a 20 mm muscle of 250 mm (written as they stand in params.toml).
FORCES = {
    "ideal_mckibben": {},
    "six_parameter": None,  # the shipped rig's own
    "corrected_mckibben": {"a_eps": 0.2, "b_eps": -1.1, "a_kappa": 0.1, "b_kappa": -0.9, "k0": 40},
    "single_pressure_exponential": {"a": 300, "b": -30, "d": -3000, "e": 700},
    "invertible_exponential": {
        **{"a": "-4 N/bar", "b": 292, "c": -33, "e": "-930 N/bar", "f": 0},
        **{"g": "294 N/bar", "h": -280},
    },
    "elastic_energy": {"working_pressure": "100 kPa", "working_contraction": 0.2},
    "pleated": {"f0": 0.11, "f1": -0.4, "f2": 0.5, "f3": -1.0, "f4": 0.0},
    "pleated_shape": {"slenderness": 6},
    "mooney_rivlin": {"c1": -150, "c2": 360, "slack_contraction": 0.002, "active_share": 0.95},
}
SPRING = {"passive.stiffness": 9000.0, "passive.softening": 33.0, "braid.extensibility": 0.0}
"""Weak enough when contracted to leave every law a pull: most hold the rubber's part themselves.
Pressure does not lengthen the braid: a pleated one cannot."""
RANGE = {"low_contraction": -0.06, "high_contraction": 0.06}
OPERATOR_FIELDS = {
    "bouc_wen": {"yield_contraction": 0.005},
    "maxwell_slip": {"elements": 6, "full_slip": 0.02},
    "prandtl_ishlinskii": {"elements": 6, "span": 0.06, "linear_share": 0.3},
    "preisach": {"levels": 8, **RANGE},
    "pleated_factor": {"levels": 8, **RANGE},
    "arctangent": {"turning_points": 6, **RANGE},
    "fractional_maxwell": {"order": 0.27, "time_constant": 0.3, "span": 0.06},
}
CHAIN = """[muscle.chain]
compliance = { value = 2, unit = "mm/kN", source = "assumed" }
relaxation_time = { value = 10, unit = "ms", source = "assumed" }

"""


def step(rig, duration, start=(3e5, 3e5), end=(3e5, 1.8e5), load=1.2, settle=0.05):
    made = pamsim.pressure_step(start, end, duration=duration, sample_rate=100.0, load=load)
    made = replace(made, settle=settle)
    return lambda **how: pamsim.simulate(rig, made, **how).completed()


def section(group, law, values, catalog):
    units = {name: spec.unit for name, spec in specs(catalog[law].group)}
    lines = [f"[muscle.{group}]", f'law = "{law}"']
    for name, value in values.items():
        number, _, unit = str(value).partition(" ")
        unit = unit or units[name]
        lines.append(f'{name} = {{ value = {number}, unit = "{unit}", source = "assumed" }}')
    return "\n".join(lines) + "\n\n"


def rig_with(tmp_path, group, text, length=250):
    """The shipped rig with one section of its params.toml replaced, or put in if it has none."""
    folder = shutil.copytree(shipped_rigs() / "mas20_arm", tmp_path / "arm")
    file = folder / "params.toml"
    toml = file.read_text(encoding="utf-8")
    if text is not None:
        toml, count = re.subn(rf"\[muscle\.{group}\]\n(.+\n)+\n", lambda _: text, toml)
        toml = toml if count else toml.replace("[native]", text + "[native]")
        assert toml.count(text) == 1
    stated = "length_at_zero = { value = 250"
    assert stated in toml
    file.write_text(toml.replace(stated, stated.replace("250", str(length))), encoding="utf-8")
    return pamsim.load_rig(folder)


def the_same_in_both_backends(run):
    fast, slow = run(), run(backend="python")
    for name in ("positions", "pressure", "tension"):
        np.testing.assert_allclose(getattr(fast, name), getattr(slow, name), rtol=1e-9, atol=1e-9)
    if sys.platform == "linux":  # there both call one mathematics library
        np.testing.assert_allclose(fast.final_state, slow.final_state, rtol=1e-12, atol=1e-12)
    return fast


def moves_the_same_in_both(rig):
    run = the_same_in_both_backends(step(rig, 0.1))  # Python is slow
    assert np.ptp(run.angle) > 1e-3
    assert np.all(run.tension >= 0.0)


def moved_by(rig, without, low, high):
    one, other = (step(each, 0.4, settle=1.0)().angle for each in (rig, without))
    assert low < np.abs(one - other).max() < high


@pytest.mark.parametrize("law", [name for name, law in FORCE_LAWS.items() if not law.pushes])
def test_every_force_law_drives_the_arm(tmp_path, law):
    text = None if FORCES[law] is None else section("force", law, FORCES[law], FORCE_LAWS)
    # At 225 mm, 10 % contracted, it is inside the range of every law.
    rig = rig_with(tmp_path, "force", text, length=225).with_parameters(SPRING)
    muscle = rig.muscles["muscle_1"]
    assert type(muscle.force).law == law
    if law not in ("single_pressure_exponential", "elastic_energy"):
        moves_the_same_in_both(rig)
    else:  # neither is a tension that follows the pressure: they run, and that is all they promise
        the_same_in_both_backends(step(rig, 0.1))
    row, coefficients = pack(muscle).tolist(), list(vars(muscle.force).values())
    for pressure, kappa in ((1e5, 0.08), (1e5, 0.13), (3.3e5, 0.08), (3.3e5, 0.13)):
        ours = static_muscle.active_force(row, pressure, kappa)
        theirs = FORCE_LAWS[law].force(pressure, kappa, coefficients, muscle.braid)
        assert ours == pytest.approx(theirs, rel=1e-12)


def test_a_force_law_that_pushes_is_the_same_in_both():
    rig = pamsim.load_rig("equimus_leg")
    assert {type(muscle.force).law for muscle in rig.muscles.values()} == {"effective_area"}
    run = the_same_in_both_backends(step(rig, 0.2, (5e4, 5e4), (1e5, 2e4), load=0.0))
    assert np.all(np.ptp(run.positions, axis=0) > 1e-3)


@pytest.mark.parametrize("name", OPERATORS)
def test_every_operator_runs_and_opens_a_loop(tmp_path, name):
    values = {"force": "20 N", "force_per_pressure": "4 N/bar", **OPERATOR_FIELDS[name]}
    rig = rig_with(tmp_path, "hysteresis", section("hysteresis", name, values, OPERATORS))
    assert type(rig.muscles["muscle_1"].hysteresis).law == name
    moves_the_same_in_both(rig)
    off = rig.with_parameters({"hysteresis.force": 0.0, "hysteresis.force_per_pressure": 0.0})
    moved_by(rig, off, 1e-4, 0.2)


def test_a_chain_that_gives_runs_and_moves_the_arm(tmp_path):
    rig = rig_with(tmp_path, "chain", CHAIN)
    chain = rig.muscles["muscle_2"].chain
    assert (chain.compliance, chain.relaxation_time) == pytest.approx((2e-6, 0.01))
    moves_the_same_in_both(rig)
    moved_by(rig, rig.with_parameters({"chain.compliance": 0.0}), 1e-3, 0.2)


def test_every_code_has_its_functions_and_no_other_has():
    for catalog, functions, places in (
        (FORCE_LAWS, law_functions, OF_LAW),
        (OPERATORS, operator_functions, OF_OPERATOR),
    ):
        for one in catalog.own():
            assert set(functions(catalog.code(one.group))) == set(places)
        for code in (0.5, 1.0 + len(catalog.own())):
            with pytest.raises(EngineError, match="stands for no law known here"):
                functions(code)
