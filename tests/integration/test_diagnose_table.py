"""A table at rest in the engine: the hidden effect is named, and the rig is repaired."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

import pamsim
from pamsim.comparison.rest_simulator import RestPredictor
from pamsim.core.errors import InputError
from pamsim.diagnosis.options import Options
from pamsim.diagnosis.published_rig import published_rig
from pamsim.diagnosis.pulley_radius import PULLEY
from pamsim.diagnosis.table_at_rest import diagnose_table, rig_with
from pamsim.recordings.static_table import read_static_table
from pamsim.report.link_page import write_link_diagnosis

TRIED = ("load_torque", "muscle_hysteresis", "viscous_friction", "passive_stiffness")
TILT = -0.12


@pytest.fixture(scope="module")
def rig():
    rig = published_rig()
    rig.model.opt.timestep = 2e-3  # for synthetic data and fit
    return rig


@pytest.fixture(scope="module")
def table(rig):
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
    ends = RestPredictor(lambda _: None, table).simulated(
        rig.with_parameters({"body.rig.tilt": TILT})
    )
    noise = 2e-3 * np.random.default_rng(1).standard_normal(ends.size)
    return dataclasses.replace(table, angle=ends + noise)


@pytest.fixture(scope="module")
def report(rig, table):
    return diagnose_table(table, rig, Options(effects=TRIED))


def test_what_is_hidden_is_named_with_its_size(report):
    found = report.to_dict()
    assert found["verdict"] == "named"
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


def test_the_repaired_rig_simulates_what_was_fitted(rig, table, report):
    (effect,), (pulley,) = report.effects, report.nuisance
    values = {name: size.value_si for name, size in effect.sizes.items()}
    radius = pulley.whole * 1e-3
    repaired = rig_with(rig, values | {PULLEY: radius})
    rows = RestPredictor(lambda _: repaired, table)
    residual = np.degrees(rows.simulated(repaired) - table.angle)
    # In the fit itself each row is off by less than where a fit to the others leaves it.
    assert np.sqrt(np.mean(residual**2)) < report.gap["angle_at_rest"].after
    for tendon in ("chain_1", "chain_2"):
        pulley = pamsim.engine.parameters.rig_parameter(repaired, f"tendon.{tendon}.coef")
        assert pulley.value == pytest.approx(radius)


def test_the_reason_why_an_effect_was_not_tried_is_stated(report):
    skipped = report.run.skipped
    assert "path" in skipped["muscle_hysteresis"]
    assert skipped["viscous_friction"] == "moves no angle at rest"
    assert "passive_stiffness" not in skipped  # a form that hardens needs no tube of the rig's own


def test_it_fits_into_json_and_makes_a_page(report, tmp_path):
    result = json.loads(json.dumps(report.to_dict(), allow_nan=False))
    assert result["schema"] == "pamsim-diagnosis/3"
    page, *figures = write_link_diagnosis(result, report.comparisons, tmp_path)
    assert report.summary() in page.read_text(encoding="utf-8")
    assert (tmp_path / "rows.png") in figures


def test_the_published_rig_is_the_first_rung_of_the_calibration(rig):
    table = read_static_table("mas20")
    ends = RestPredictor(lambda _: None, table).simulated(rig)
    recorded = json.loads((rig.file.folder / "calibration.json").read_text(encoding="utf-8"))
    rms = np.degrees(np.sqrt(np.mean((ends - table.angle) ** 2)))
    assert rms == pytest.approx(recorded["static_models"][0]["rms_deg"], abs=2e-3)


def test_a_table_of_another_rig_and_an_unknown_effect_are_refused(rig):
    table = read_static_table("mas20")
    one = dataclasses.replace(table, pressure=table.pressure[:, :1])
    with pytest.raises(InputError, match="is of 1 muscles"):
        diagnose_table(one, rig)
    with pytest.raises(InputError, match="did you mean 'load_torque'"):
        diagnose_table(table, rig, Options(effects=("load_torq",)))
