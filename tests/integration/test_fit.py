"""``pamsim fit`` and ``pamsim list models`` as a user types them."""

from __future__ import annotations

import json
import re
import tomllib
from importlib import resources

import numpy as np
import pytest

from pamsim.fitting.fit import fit
from pamsim.fitting.force_map import named_law
from pamsim.fitting.maxwell import maxwell_loop
from pamsim.physics.braid import Braid
from pamsim.recordings.printed import loop_equation
from tests.typed_command import run
from tests.unit.report.page_laws import check_page

DATA = resources.files("pamsim") / "data"
DMSP_20 = DATA / "dmsp20_300_force_map.csv"
BRAID = Braid(nominal_length=0.3, diameter=0.02, fibre_angle=np.radians(28.6))


def test_planted_coefficients_come_back_through_a_file(tmp_path):
    law = named_law("mooney_rivlin")
    planted = [1.4, -100.0, 300.0, 0.003, 0.96]
    rows = ["p_bar,length_mm,force_n"]
    for bar in (1, 2, 3.5, 5, 6):
        for mm in (297, 285, 270, 250, 240):
            force = law.force(1e5 * bar, 1.0 - mm / 300.0, planted, BRAID)
            rows.append(f"{bar},{mm},{force!r}")
    (tmp_path / "map.csv").write_text("\n".join(rows), encoding="utf-8")
    result = fit(
        tmp_path / "map.csv", model="mooney_rivlin", nominal_length=0.3, diameter=0.02,
        fibre_angle=np.radians(28.6), hold_out="none",
    )  # fmt: skip
    assert result.fits[0].fit.values == pytest.approx(planted, rel=1e-4)
    assert result.fits[0].held_out is None


def test_fit_writes_figure_and_parameters_that_parse_back(tmp_path, monkeypatch, capsys):
    code, out, _ = run(
        monkeypatch, capsys, "fit", DMSP_20, "--model", "six_parameter", "--out", tmp_path / "o",
        "--json", tmp_path / "r.json",
    )  # fmt: skip
    assert code == 0
    assert "66 points of zero force dropped" in out
    assert "6.199 N RMS" in out
    assert (tmp_path / "o" / "fit.png").stat().st_size > 20_000
    page = (tmp_path / "o" / "index.html").read_text(encoding="utf-8")
    assert "<b>6.20 N</b> 60 points, 6 coefficients" in page
    check_page(page)
    result = json.loads((tmp_path / "r.json").read_text())
    parsed = tomllib.loads((tmp_path / "o" / "params.toml").read_text(encoding="utf-8"))
    force = parsed["muscle"]["force"]
    assert force.pop("law") == "six_parameter"
    assert "braid" not in parsed["muscle"]  # the law does not look at it
    for c in result["fits"][0]["coefficients"]:
        entry = force[c["name"]]
        assert (entry["value"], entry["unit"]) == (c["value"], c["unit"])
        assert entry["source"] == ("assumed" if c["held"] else "identified")
        if not c["held"]:
            low, high = entry["interval95"]
            assert low < entry["value"] < high


@pytest.mark.parametrize("model", ["six_parameter", "mooney_rivlin"])
def test_fitted_parameters_run_in_a_rig(tmp_path, monkeypatch, capsys, model):
    """The section replaces the one of the shipped rig, word for word."""
    from pamsim.recordings.rig_file import shipped_rigs

    run(monkeypatch, capsys, "fit", DMSP_20, "--model", model, "--hold-out", "none",
        "--out", tmp_path / "o")  # fmt: skip
    written = (tmp_path / "o" / "params.toml").read_text(encoding="utf-8")
    section = written[written.index("[muscle.force]") :]
    rig = tmp_path / "rig"
    rig.mkdir()
    for path in (shipped_rigs() / "mas20_arm").glob("*.*"):
        if path.suffix not in (".toml", ".xml"):
            continue
        text = path.read_text(encoding="utf-8")
        if path.name == "params.toml":
            start = text.index("[muscle.force]")
            text = text[:start] + section + "\n" + text[text.index("\n[", start) + 1 :]
        (rig / path.name).write_text(text, encoding="utf-8")
    code, out, err = run(
        monkeypatch, capsys, "step", "--rig", rig, "--pressure", "300,200", "--duration", "0.2"
    )
    assert (code, err) == (0, "")
    assert "deg" in out


@pytest.mark.slow
def test_compare_ranks_by_unseen_lengths_and_says_what_is_left_out(tmp_path, monkeypatch, capsys):
    lines = DMSP_20.read_text(encoding="utf-8").splitlines()
    # Every third pressure, since the exact shape of a pleated muscle is slow to evaluate.
    kept = lines[:2] + [line for i, line in enumerate(lines[2:]) if (i // 6) % 3 == 2]
    (tmp_path / "map.csv").write_text("\n".join(kept), encoding="utf-8")
    code, out, err = run(
        monkeypatch, capsys, "fit", tmp_path / "map.csv", "--compare", "--diameter", "20",
        "--fibre-angle", "28.6", "--json", tmp_path / "r.json", "--out", tmp_path / "o",
    )  # fmt: skip
    assert (code, err) == (0, "")
    result = json.loads((tmp_path / "r.json").read_text())
    assert result["fits"][0]["model"] == "mooney_rivlin"
    errors = [f["held_out"]["rmse"] for f in result["fits"]]
    assert errors == sorted(errors)
    assert set(result["skipped"]) == {
        "single_pressure_exponential", "elastic_energy", "effective_area",
    }  # fmt: skip
    assert "not fitted: elastic_energy: counts from a working point" in out
    section = tomllib.loads((tmp_path / "o" / "params.toml").read_text(encoding="utf-8"))
    assert section["muscle"]["braid"]["diameter"]["source"] == "given to the fit"


def test_one_isobar_suits_the_law_of_one_pressure(tmp_path):
    rows = [f"300,{k},{400 * np.exp(-30 * k) - 2500 * k + 500}" for k in np.linspace(0, 0.2, 12)]
    (tmp_path / "isobar.csv").write_text("p_kpa,contraction,force_n\n" + "\n".join(rows))
    result = fit(tmp_path / "isobar.csv", model="single_pressure_exponential", hold_out="none")
    assert result.fits[0].fit.values == pytest.approx([1.0, 400.0, -30.0, -2500.0, 500.0], rel=1e-5)


def test_printed_arctangent_comes_back_from_a_length_loop(tmp_path, monkeypatch, capsys):
    printed = {b: [each.value for each in loop_equation(b)] for b in ("up", "down")}
    rows = ["p_kpa,length_cm,branch"]
    for name, (k0, k1, k2, k3) in printed.items():
        rows += [f"{p},{k0 * np.arctan(k1 * p + k2) + k3},{name}" for p in range(0, 501, 50)]
    (tmp_path / "loop.csv").write_text("\n".join(rows), encoding="utf-8")
    code, out, _ = run(
        monkeypatch, capsys, "fit", tmp_path / "loop.csv", "--model", "arctangent",
        "--hold-out", "none", "--nominal-length", "300", "--out", tmp_path / "o",
        "--json", tmp_path / "r.json",
    )  # fmt: skip
    assert code == 0
    assert "falling branch" in out
    result = json.loads((tmp_path / "r.json").read_text())
    k0, k1, k2, k3 = printed["up"]
    values = [c["value"] for c in result["fits"][0]["coefficients"]]
    assert values == pytest.approx([k0 / 100, k1 / 1000, k2, k3 / 100], rel=1e-4)
    entries = tomllib.loads((tmp_path / "o" / "params.toml").read_text())["muscle"]["hysteresis"]
    # the same numbers that the operator has for defaults
    assert entries["steepness_rising"]["value"] == pytest.approx(4.1606, rel=1e-3)
    assert entries["middle_falling"]["value"] == pytest.approx(0.2695, rel=1e-3)


def test_planted_maxwell_element_comes_back_from_force_loops(tmp_path, monkeypatch, capsys):
    rows = ["loop,time_s,force_n,displacement_mm"]
    for hz in (1, 3, 10):
        loop = maxwell_loop(0.4, 0.05, 2e4, 2.0 * np.pi * hz, 150.0)
        for u in np.arange(0.0, 4.0 * np.pi, 0.1):
            x = loop.at_force * np.sin(u) + loop.at_zero * np.cos(u)
            rows.append(f"{hz},{u / loop.frequency},{150.0 * np.sin(u)},{1e3 * x}")
    (tmp_path / "loops.csv").write_text("\n".join(rows), encoding="utf-8")
    code, out, _ = run(
        monkeypatch, capsys, "fit", tmp_path / "loops.csv", "--compare", "--nominal-length", "300",
        "--out", tmp_path / "o",
    )  # fmt: skip
    assert code == 0
    assert "differential_evolution" in out
    entries = tomllib.loads((tmp_path / "o" / "params.toml").read_text())["muscle"]["hysteresis"]
    assert entries["order"]["value"] == pytest.approx(0.4, rel=1e-4)
    assert entries["time_constant"]["value"] == pytest.approx(0.05, rel=1e-3)
    assert entries["force"]["value"] == pytest.approx(2e4 * 0.3 * 0.01, rel=1e-3)
    assert (tmp_path / "o" / "fit.png").exists()


def test_a_coefficient_can_be_held_with_its_unit(monkeypatch, capsys):
    code, out, _ = run(
        monkeypatch, capsys, "fit", DMSP_20, "--model", "six_parameter", "--hold-out", "none",
        "--hold", "e=294 N/bar", "--hold", "b=0.3kN",
    )  # fmt: skip
    assert code == 0
    held = [line.split() for line in out.splitlines() if line.endswith("held")]
    assert [[h[0], float(h[1])] for h in held] == [["scale", 1.0], ["b", 300.0], ["e", 0.00294]]


BAD = {
    "no such file": (["missing.csv", "--model", "six_parameter"], "No such file"),
    "neither": ([DMSP_20], "either --model or --compare"),
    "both": ([DMSP_20, "--model", "six_parameter", "--compare"], "either --model"),
    "unknown law": ([DMSP_20, "--model", "six_parametre"], "did you mean 'six_parameter'"),
    "wrong kind": (
        [DMSP_20, "--model", "arctangent"],
        "is a force map: model 'arctangent' does not",
    ),
    "hold-out": ([DMSP_20, "--compare", "--hold-out", "lengths"], "did you mean 'length'"),
    "isobars": ([DMSP_20, "--model", "single_pressure_exponential"], "holds at one pressure"),
    "no tension": ([DMSP_20, "--model", "elastic_energy"], "counts from a working point"),
    "bad unit": ([DMSP_20, "--compare", "--nominal-length", "3kg"], "does not measure"),
    "braid": ([DMSP_20, "--model", "ideal_mckibben", "--diameter", "2m"], "braid.diameter = 2"),
    "hold what": ([DMSP_20, "--model", "six_parameter", "--hold", "scale"], "write NAME=VALUE"),
    "hold whom": ([DMSP_20, "--model", "six_parameter", "--hold", "g=1"], "no coefficient 'g'"),
    "hold any": ([DMSP_20, "--compare", "--hold", "zeta=1"], "no force law has a coefficient"),
    "hold beyond": ([DMSP_20, "--model", "six_parameter", "--hold", "c=5"], "outside [-200, 0]"),
    "disagreeing": ([DMSP_20, "--compare", "--nominal-length", "250"], "length and contraction"),
    "unknown model": (["six_parametre"], "did you mean 'six_parameter'"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_line_and_exit_2(monkeypatch, capsys, name):
    args, expected = BAD[name]
    command = ("list", "models") if name == "unknown model" else ("fit",)
    code, out, err = run(monkeypatch, capsys, *command, *args)
    assert code == 2, out
    assert expected in err
    assert err.count("\n") == 1
    assert err.startswith("pamsim: error: ")


def test_loops_that_do_not_determine_the_element_are_refused(tmp_path, monkeypatch, capsys):
    u = np.arange(0.0, 20.0, 0.1)
    rows = [f"{t},{100 * np.sin(t)},{np.sin(t - 0.2)}" for t in u]
    path = tmp_path / "one.csv"
    path.write_text("time_s,force_n,displacement_mm\n" + "\n".join(rows), encoding="utf-8")
    for args, expected in (
        (["--compare"], "two equations for three unknowns"),
        (["--compare", "--hold-out", "length"], "none to hold out"),
        (["--model", "six_parameter"], "use 'fractional_maxwell'"),
    ):
        code, _, err = run(monkeypatch, capsys, "fit", path, *args)
        assert (code, err.count("\n")) == (2, 1)
        assert expected in err


def test_models_lists_everything_and_shows_one(tmp_path, monkeypatch, capsys):
    code, out, _ = run(monkeypatch, capsys, "list", "models", "--json", tmp_path / "m.json")
    assert code == 0
    result = json.loads((tmp_path / "m.json").read_text())
    names = [e["name"] for e in (*result["force_laws"], *result["operators"])]
    assert {"six_parameter", "mooney_rivlin", "ideal_mckibben", "bouc_wen", "preisach"} <= set(
        names
    )
    assert all(name in out for name in names)
    for entry in (*result["force_laws"], *result["operators"]):
        assert entry["equation"]
        assert entry["source"]
        assert all(p["unit"] and p["doc"] for p in entry["parameters"])
    code, out, _ = run(monkeypatch, capsys, "list", "models", "six_parameter")
    assert code == 0
    assert "[-200, 0]" in out
    assert re.search(r"inverse p\(F, kappa\): +yes", out)
    code, out, _ = run(monkeypatch, capsys, "list", "models", "bouc_wen")
    assert re.search(r"rate-independent: +yes", out)
