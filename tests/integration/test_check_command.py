"""`pamsim check`: what was read, what is implausible, what the data could show."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

import pamsim
from pamsim.cli.main import main
from pamsim.twins.hide import hide

SETTINGS = {"protocols": ("triangle", "bursts"), "duration": 2.0, "repeats": 3, "seed": 3}
EFFECTS = "viscous_friction,valve_flow,sprocket_ripple,angle_bias"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("check") / "data"
    hide("mas20_arm", {}, **SETTINGS).save(folder)
    return folder


def run(monkeypatch, capsys, *args):
    """Exit code and output of the command."""
    monkeypatch.setattr(sys, "argv", ["pamsim", "check", *map(str, args)])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code or 0, capsys.readouterr().out


def changed(recorded, folder, change):
    """The recording with every row of its CSV files changed."""
    folder.mkdir()
    for path in recorded.iterdir():
        text = path.read_text()
        if path.suffix == ".csv":
            header, *rows = text.splitlines()
            names = header.split(",")
            table = np.array([row.split(",") for row in rows], dtype=float)
            change(names, table)
            text = "\n".join([",".join(names), *(",".join(map(repr, r)) for r in table.tolist())])
        (folder / path.name).write_text(text)
    return folder


def suspicions(folder):
    return pamsim.check(folder, effects=["viscous_friction"]).suspicions


def test_a_good_recording_is_described_and_raises_no_suspicion(
    recorded, tmp_path, monkeypatch, capsys
):
    file = tmp_path / "check.json"
    code, shown = run(monkeypatch, capsys, recorded, "--effects", EFFECTS, "--json", file)
    assert code == 0
    found = json.loads(file.read_text())
    assert found["schema"] == "pamsim-check/1"
    assert sum(found["protocols"].values()) == 12
    assert set(found["held_out"]) < {p.stem for p in recorded.glob("*.csv")}
    angle = found["channels"]["angle"]
    assert angle["low"] < 0.0 < angle["high"]
    assert angle["missed"] == pytest.approx(angle["floor"], rel=0.3)  # nothing is hidden
    assert {"viscous_friction", "valve_flow", "angle_bias"} <= set(found["seen"])
    assert "angle" in shown
    assert "suspicious" not in shown


def test_a_turned_sign_is_suspicious(recorded, tmp_path, monkeypatch, capsys):
    def turn(names, table):
        table[:, names.index("angle_deg")] *= -1.0

    folder = changed(recorded, tmp_path / "turned", turn)
    code, shown = run(monkeypatch, capsys, folder, "--effects", "viscous_friction")
    assert code == 1
    assert "suspicious: angle moves against the simulation" in shown


@pytest.mark.parametrize(
    ("column", "factor", "expected"),
    [("angle_deg", np.pi / 180.0, "rad, not deg"), ("force1_n", 1e-3, "kN, not N")],
)
def test_a_slip_of_units_is_named(recorded, tmp_path, column, factor, expected):
    def slip(names, table):
        table[:, names.index(column)] *= factor

    (found,) = suspicions(changed(recorded, tmp_path / "slip", slip))
    assert expected in found


def test_what_the_inputs_cannot_show_is_said(tmp_path):
    hide("mas20_arm", {}, **SETTINGS, measured_drive=True).save(tmp_path / "data")
    found = pamsim.check(tmp_path / "data", effects=["viscous_friction", "air_leak", "valve_flow"])
    assert found.seen == ("viscous_friction",)
    assert set(found.unseen) == {"air_leak", "valve_flow"}
    assert any("measured pressures" in note for note in found.notes)
