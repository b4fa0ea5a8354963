"""A diagnosis in the engine: what is hidden in synthetic recordings is found on held-out trials."""

from __future__ import annotations

import pytest

from pamsim.comparison.links import PARTS
from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link.held_out import HeldOut
from pamsim.diagnosis.by_link.remainder import Remainder
from pamsim.diagnosis.diagnose import diagnose
from pamsim.twins.hide import hide

TRIED = ("air_leak", "coulomb_friction")
SHORT = {"protocols": ("bursts",), "repeats": 5, "duration": 1.5, "forces": False, "seed": 4}


@pytest.mark.parametrize("effects", [{}, {"air_leak": 2.0}], ids=["nothing", "air_leak"])
def test_what_is_hidden_is_named_and_nothing_else(effects, tmp_path):
    hide("mas20_arm", effects, **SHORT).save(tmp_path / "data")
    found = diagnose([tmp_path / "data"], effects=TRIED, nuisance=("force.scale",))
    assert found.verdict.value == ("named" if effects else "no_gap")
    assert [one.name for one in found.effects] == list(effects)
    if effects:
        leak = found.effects[0].sizes["chamber.leak_conductance"]
        assert leak.value_si == pytest.approx(4e-12, rel=0.05)
        air, arm = found.links
        assert air.before > 1.5 > air.after
        assert arm.before == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(("of_whole", "level"), [(0.0, "form"), (0.5, "family")])
def test_what_links_have_left_costs_the_name_only_if_the_whole_chain_has_it_too(
    of_whole, level, tmp_path, monkeypatch
):
    def left(self, model):
        return {
            link: Remainder(excess=of_whole if link.parts == PARTS else 0.1, p_value=0.004)
            for link in self.links
        }

    monkeypatch.setattr(HeldOut, "remainders", left)
    hide("mas20_arm", {"air_leak": 6.0}, **SHORT).save(tmp_path / "data")
    found = diagnose([tmp_path / "data"], effects=TRIED, nuisance=("force.scale",))
    (leak,) = found.effects
    assert (leak.level, leak.exact) == (level, level == "form")
    assert bool(found.remainder) == (level == "family")


def test_data_and_trials_to_judge_by_must_exist(tmp_path):
    hide("mas20_arm", {}, **SHORT).save(tmp_path / "data")
    with pytest.raises(InputError, match="did you mean 'bursts'"):
        diagnose([tmp_path / "data"], hold_out=["burst"])
    with pytest.raises(InputError, match="recordings alone, or one table"):
        diagnose([tmp_path / "data", "mas20"])
    with pytest.raises(InputError, match="`hold_out` does not apply to a table of angles at rest"):
        diagnose("mas20", hold_out=["angle"])
