"""A muscle in a tensile machine: the effect that its forces lack is named."""

from __future__ import annotations

import pytest

import pamsim
from pamsim.twins.hide import hide

pytestmark = pytest.mark.slow


def test_hysteresis_is_named_from_the_force_under_an_imposed_length(tmp_path):
    """The force of the machine alone, as where no cell sits beside the muscle."""
    rig = pamsim.load_rig("muscle_bench")
    rig.model.opt.timestep = 1e-3  # for synthetic data and fit
    hide(
        rig,
        {"muscle_hysteresis": 1.5},
        protocols=("stretch",),
        duration=1.0,
        repeats=5,
        forces=False,
        seed=2,
    ).save(tmp_path / "data")
    result = pamsim.diagnose(tmp_path / "data", rig=rig, effects=["muscle_hysteresis", "air_leak"])
    assert [effect.name for effect in result.effects] == ["muscle_hysteresis"]
    assert "muscle and joint" in result.effects[0].links
    gap = result.gap["rod.force"]
    assert gap.after < 0.3 * gap.before
