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


@pytest.mark.parametrize("job", JOBS)
def test_every_result_has_the_verbs(job):
    result = typing.get_type_hints(getattr(pamsim, job))["return"]
    for one in typing.get_args(result) or (result,):
        for verb in ("summary", "to_dict", "save"):
            assert inspect.isfunction(getattr(one, verb, None)), f"{one.__name__}.{verb}"


@pytest.fixture(scope="module")
def recording():
    rig = pamsim.load_rig("mas20_arm")
    step = pamsim.pressure_step((3e5, 3e5), (4e5, 1e5), duration=1.0, load=1.2, name="a step")
    return pamsim.simulate(rig, step).completed()


@pytest.fixture(scope="module")
def results(recording, tmp_path_factory):
    folder = tmp_path_factory.mktemp("data")
    recording.save(folder / "recording")
    hidden = pamsim.hide(
        "mas20_arm", {"air_leak": 1.0}, protocols=("triangle",), repeats=5, duration=0.5
    )
    hidden.save(folder / "hidden")
    return {
        "recording": recording,
        "identification": pamsim.identify(folder / "recording", order=1, local=False),
        "fit": pamsim.fit(FORCE_MAP, model="six_parameter"),
        "calibration": pamsim.calibrate(
            [folder / "recording"], free=["joint.shaft.damping"], max_iterations=3
        ),
        "diagnosis of recordings": pamsim.diagnose(
            folder / "hidden", effects=["air_leak"], nuisance=["force.scale"]
        ),
        "diagnosis of a loop": pamsim.diagnose("alraouf2025_equations"),
        "synthetic recording": hidden,
    }


DRAWN = (
    "recording",
    "identification",
    "fit",
    "calibration",
    "diagnosis of recordings",
    "diagnosis of a loop",
)


@pytest.mark.parametrize("name", [*DRAWN, "synthetic recording"])
def test_verbs_give_text_json_and_files(results, name, tmp_path):
    result = results[name]
    assert result.summary().strip()
    assert json.loads(json.dumps(result.to_dict(), allow_nan=False))
    result.save(tmp_path / "out")
    assert any(path.is_file() for path in tmp_path.rglob("*"))


@pytest.mark.parametrize("name", DRAWN)
def test_plot_draws_it(results, name):
    figure = pamsim.plot(results[name])
    assert isinstance(figure, Figure)
    assert figure.axes


def test_a_saved_recording_is_read_back(recording, tmp_path):
    recording.save(tmp_path)
    (trial,) = pamsim.read_recordings(tmp_path).trials
    assert trial.name == "a_step"


def test_what_has_no_picture_is_refused(results):
    with pytest.raises(InputError, match="no picture of a SyntheticRecording"):
        pamsim.plot(results["synthetic recording"])
