"""A diagnosis in the engine: what is hidden in synthetic recordings is found on held-out trials."""

from __future__ import annotations

import pytest

import pamsim
from pamsim.core.errors import InputError
from pamsim.diagnosis.diagnose import diagnose
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.recordings.recording import write_recording
from pamsim.twins.hide import hide

TRIED = ("air_leak", "coulomb_friction")


@pytest.fixture(scope="module")
def rig():
    rig = pamsim.load_rig("mas20_arm")
    rig.model.opt.timestep = 1e-3  # for synthetic data and fit
    return rig


@pytest.fixture(autouse=True)
def short_trials(monkeypatch):
    monkeypatch.setattr("pamsim.comparison.protocols.DURATION", 3.2)


def recorded(rig, effects, folder):
    data = hide(rig, dict(effects), protocols=("bursts",), repeats=7, seed=4)
    write_recording(folder, "mas20_arm", data.trials, data.protocols)
    return folder


@pytest.mark.parametrize(
    ("effects", "verdict"),
    [([], Verdict.NO_GAP), ([("air_leak", 1.0)], Verdict.NAMED)],
    ids=["nothing", "air_leak"],
)
def test_what_is_hidden_is_named_and_nothing_else(rig, effects, verdict, tmp_path):
    folder = recorded(rig, effects, tmp_path / "data")
    found = diagnose([folder], rig=rig, effects=TRIED, nuisance=("force.scale",)).method
    assert found.conclusion.verdict is verdict
    if effects:
        best = found.conclusion.best
        assert best.names == ("air_leak",)
        assert found.cells[0].channel.startswith("pressure")
        assert best.fit.values["chamber.leak_conductance"] == pytest.approx(2e-12, rel=0.05)
        perfect = sum(found.perfect_loss.values()) / len(found.perfect_loss)
        base = sum(found.base_loss.values()) / len(found.base_loss)
        assert best.mean_loss < 1.1 * perfect < base
    else:
        assert found.conclusion.best is None


def test_trials_to_judge_by_must_exist(rig, tmp_path):
    folder = recorded(rig, [], tmp_path / "data")
    with pytest.raises(InputError, match="did you mean 'bursts'"):
        diagnose([folder], rig=rig, hold_out=["burst"])
    with pytest.raises(InputError, match="recordings alone, or one table"):
        diagnose([folder, "mas20"])
    with pytest.raises(InputError, match="`channels` does not apply to a table of angles at rest"):
        diagnose("mas20", channels=["angle"])


@pytest.mark.parametrize("effects", [{}, {"coulomb_friction": 1.0}], ids=["nothing", "friction"])
def test_one_log_without_repeats_is_judged_by_its_parts(rig, effects, tmp_path):
    data = hide(rig, effects, protocols=("bursts",), repeats=1, seed=6)
    log, _ = data.trials.items()
    write_recording(tmp_path / "data", "mas20_arm", dict([log]), {log[0]: data.protocols[log[0]]})
    found = diagnose([tmp_path / "data"], rig=rig, effects=TRIED, nuisance=("force.scale",))
    assert [e.name for e in found.effects] == list(effects)
    assert found.verdict is (Verdict.NAMED_WITH_REMAINDER if effects else Verdict.NO_GAP)
    assert found.held_out_method.startswith("parts of trials")
    assert len(found.held_out) == 2
    assert all(name.startswith(f"{log[0]}_part_") for name in found.held_out)
    assert found.details.noise_floor["route"] == "within trials"
    assert any("recorded once" in warning for warning in found.warnings)
    assert all(gap.floor.interval95 is None for gap in found.gap.values())
    assert all(comparison.held_out for comparison in found.comparisons)
    if effects:
        assert "resembles it is not testable with these repeats" in found.summary()
        assert found.over_floor(repaired=True) < 1.2 < found.over_floor(repaired=False)
        found.save(tmp_path / "out")
        assert (tmp_path / "out" / "rig").is_dir()
