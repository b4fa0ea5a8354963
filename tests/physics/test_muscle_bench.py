"""The bench with one muscle: the numbers of its README."""

from __future__ import annotations

import re

import numpy as np
import pytest

import pamsim
from pamsim.engine.simulate import simulate
from pamsim.recordings.experiment import Experiment, pressure_step
from pamsim.recordings.rig_file import find_rig


@pytest.fixture(scope="module")
def rig():
    return pamsim.load_rig("muscle_bench")


@pytest.fixture(scope="module")
def readme():
    return (find_rig("muscle_bench") / "README.md").read_text(encoding="utf-8")


def test_numbers_of_the_readme_are_those_of_the_rig(rig, readme):
    rows = re.findall(r"\| 300 kPa, (\d+) mm \| tension (\d+) N, .* (\d+) N \|", readme)
    assert len(rows) == 2
    for length, tension, force in rows:
        held = Experiment(
            drive={"muscle": "pressure_set", "rod": "length"},
            command_time=np.zeros(1),
            command_value=np.array([[3e5, 1e-3 * float(length) - 0.25]]),
            start_pressure=np.array([3e5]),
            duration=0.01,
        )
        run = simulate(rig, held).completed()
        found = (run.signal("muscle.force")[-1], run.signal("rod.force")[-1])
        assert tuple(f"{value:.0f}" for value in found) == (tension, force)
    ((hung,),) = [re.findall(r"10 kg hung on \| length ([\d.]+) mm", readme)]
    run = simulate(rig, pressure_step([3e5], [3e5], duration=0.01, load=10.0)).completed()
    assert f"{250.0 + 1e3 * run.positions[-1, 0]:.1f}" == hung
    assert "0.5 kg" in readme
    assert rig.model.body("rod").mass[0] == 0.5
