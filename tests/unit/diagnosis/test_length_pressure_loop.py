"""The loop of Alraouf 2025 in both forms in which it is printed, and what may be said of each."""

import json

import numpy as np
import pytest

from pamsim.comparison.loop_simulator import Loop
from pamsim.core.errors import InputError
from pamsim.diagnosis.diagnose import Kind, diagnose, kind_of
from pamsim.diagnosis.length_pressure_loop import (
    PRINTED_LOOPS,
    diagnose_length_loop,
    printed_loop,
)


@pytest.fixture(scope="module")
def reports():
    return {name: diagnose(name) for name in PRINTED_LOOPS}


def test_printed_branches_are_opened_by_hysteresis_or_creep(reports):
    found = reports["alraouf2025_equations"].to_dict()
    assert found["verdict"] == "ambiguous"
    (one,) = found["effects"]
    assert (one["effect"], one["level"]) == ("muscle_hysteresis:bouc_wen", "place")
    tied = {rival["effect"] for rival in one["rivals"] if rival["ties"]}
    assert "viscoelastic_creep:creep" in tied
    assert "drift" not in tied
    gap = found["gap"]["length"]
    assert gap["after"] < 0.5 * gap["before"]
    assert list(found["remainder"]) == ["muscle and joint"]
    assert "rate" in found["next_experiment"]["advice"]


def test_printed_means_do_not_carry_a_name(reports):
    """Their branches cross twice, and differ by little more than three runs scatter."""
    found = reports["alraouf2025"].to_dict()
    assert found["verdict"] == "no_gap"
    assert found["effects"] == []
    (link,) = found["links"]
    assert link["p_value"] > 0.05
    gap = found["gap"]["length"]
    assert gap["before"] == pytest.approx(2.11, abs=0.005)
    assert 1.0 < gap["floor"] < gap["before"]
    assert "more runs" in found["next_experiment"]["advice"]


def test_readings_keep_the_order_of_the_path():
    loop = printed_loop("alraouf2025")
    assert loop.pressure[0] == loop.pressure[-1] == 0.0
    assert loop.pressure[10] == loop.pressure[11] == 500e3
    assert loop.length[:2] == pytest.approx([0.30053, 0.2972])
    assert loop.length[-2:] == pytest.approx([0.30073, 0.3005])
    assert loop.error[1] == pytest.approx(0.00624 / np.sqrt(3))


def test_viscous_friction_is_tried_where_it_is_named(reports):
    for report in reports.values():
        json.dumps(report.to_dict(), allow_nan=False)
        assert "in motion" in report.run.skipped["viscous_friction"]
    moving = diagnose("alraouf2025_equations", effects=["viscous_friction"])
    assert [one.name for one in moving.effects] == ["viscous_friction"]
    assert (moving.run.effects_tried, moving.run.skipped) == (1, {})


def test_a_measured_loop_is_diagnosed_like_the_printed_one(reports, tmp_path):
    loop = printed_loop("alraouf2025_equations")
    rows = zip(loop.pressure / 1e3, loop.length * 1e3, loop.rising, strict=True)
    text = "".join(f"{p},{x:.17g},{'up' if up else 'down'}\n" for p, x, up in rows)
    path = tmp_path / "loop.csv"
    path.write_text("p_kpa,length_mm,branch\n" + text, encoding="utf-8")
    assert kind_of([path]) is Kind.LOOP
    found = diagnose(path)
    assert (found.verdict, found.run.data) == ("ambiguous", ("loop.csv",))
    printed = reports["alraouf2025_equations"]
    assert found.gap["length"].before == pytest.approx(printed.gap["length"].before)


def test_what_does_not_apply_to_a_loop_or_opens_none_is_refused():
    with pytest.raises(InputError, match="did you mean 'alraouf2025'"):
        printed_loop("alraouf")
    with pytest.raises(InputError, match="`hold_out` does not apply to a length-pressure loop"):
        diagnose("alraouf2025", hold_out=["up"])
    with pytest.raises(InputError, match="did you mean 'viscous_friction'"):
        diagnose("alraouf2025", effects=["viscous_frictio"])
    there = np.linspace(0.0, 4e5, 6)
    path = np.concatenate([there, there[::-1]])
    closed = Loop(pressure=path, length=0.3 - 1e-7 * path, rising=np.arange(12) < 6)
    with pytest.raises(InputError, match="the same at every pressure"):
        diagnose_length_loop(closed, "loop.csv")


@pytest.mark.parametrize("header", ["p_kpa;length_mm", "P_kPa,Length_mm", '"p_kpa"\t"length_mm"'])
def test_a_loop_is_known_however_a_spreadsheet_writes_it(tmp_path, header):
    separator = next(mark for mark in ",;\t" if mark in header)
    rows = [f"{pressure}{separator}300" for pressure in (0, 100, 0)]
    (tmp_path / "loop.csv").write_text("\n".join([header, *rows]), encoding="utf-8")
    assert kind_of([tmp_path / "loop.csv"]) is Kind.LOOP
