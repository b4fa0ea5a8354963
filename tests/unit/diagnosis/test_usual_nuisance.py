"""What is refitted with every effect is what a rig has."""

from __future__ import annotations

import pytest

import pamsim
from pamsim.comparison.free_parameters import freed_parameters
from pamsim.diagnosis.options import NUISANCE, usual_nuisance


@pytest.mark.parametrize("kind", ["joint", "leg", "bench", "bellows"])
def test_every_template_has_its_nuisance_parameters(kind, tmp_path):
    rig = pamsim.load_rig(pamsim.new_rig("own", kind, out=tmp_path / "own"))
    names = usual_nuisance(rig)
    assert set(NUISANCE) - set(names) == ({"passive.locking"} if kind == "bellows" else set())
    assert [freed.name for freed in freed_parameters(rig, names)] == list(names)
