"""Results of all jobs have the same verbs, and `pamsim.plot` draws them."""

from __future__ import annotations

import inspect
import json
import typing
from pathlib import Path

import pytest
from matplotlib.figure import Figure

import pamsim
from pamsim.core.errors import InputError

FORCE_MAP = Path(pamsim.__file__).parent / "data" / "dmsp10_250_force_map.csv"
JOBS = ("simulate", "identify", "fit", "calibrate", "diagnose", "hide", "reproduce", "replicate")


def test_every_result_has_the_verbs():
    for job in JOBS:
        result = typing.get_type_hints(getattr(pamsim, job))["return"]
        for one in typing.get_args(result) or (result,):
            for verb in ("summary", "to_dict", "save"):
                assert inspect.isfunction(getattr(one, verb, None)), f"{one.__name__}.{verb}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("data")


@pytest.fixture(scope="module")
def results(folder):
    step = pamsim.pressure_step((3e5, 3e5), (4e5, 1e5), duration=1.0, load=1.2, name="a step")
    recording = pamsim.simulate(pamsim.load_rig("mas20_arm"), step).completed()
    recording.save(folder / "recording")
    leak = {"protocols": ("triangle",), "repeats": 5, "duration": 0.5}
    hidden = pamsim.hide("mas20_arm", {"air_leak": 1.0}, **leak)
    hidden.save(folder / "hidden")
    one_model = {"dead_time": "none", "arx": (1, 1, 1), "oe": (1, 1, 1), "local": False}
    damping = {"free": ["joint.shaft.damping"], "max_iterations": 1}
    return {
        "recording": recording,
        "identification": pamsim.identify(folder / "recording", order=1, **one_model),
        "fit": pamsim.fit(FORCE_MAP, model="six_parameter"),
        "calibration": pamsim.calibrate([folder / "recording"], **damping),
        "diagnosis of recordings": pamsim.diagnose(
            folder / "hidden", effects=["air_leak"], nuisance=["force.scale"]
        ),
        "diagnosis of a loop": pamsim.diagnose("alraouf2025_equations"),
        "synthetic recording": hidden,
    }


def test_verbs_give_text_json_files_and_a_picture(results, tmp_path):
    for name, result in results.items():
        assert result.summary().strip(), name
        assert json.loads(json.dumps(result.to_dict(), allow_nan=False)), name
        result.save(tmp_path / name / "out")
        assert any(path.is_file() for path in (tmp_path / name).rglob("*")), name
        if name == "synthetic recording":
            with pytest.raises(InputError, match="no picture of a SyntheticRecording"):
                pamsim.plot(result)
        else:
            figure = pamsim.plot(result)
            assert isinstance(figure, Figure), name
            assert figure.axes, name


def test_a_saved_recording_is_read_back(results, folder):
    (trial,) = pamsim.read_recordings(folder / "recording").trials
    assert trial.name == "a_step"
