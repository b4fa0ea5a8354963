"""Results of all jobs have the same verbs, a picture, and a table."""

import inspect
import json
import math
import typing
from pathlib import Path

import numpy as np
import pyarrow
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


def rows_of(columns):
    assert len({len(column) for column in columns.values()}) == 1
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def test_a_table_has_a_row_for_each_sample_or_parameter_in_si(results, folder):
    tables = {name: pamsim.table(one) for name, one in results.items() if "synth" not in name}
    for name, columns in tables.items():
        assert bool(rows_of(columns)) == (name != "diagnosis of recordings"), name  # finds nothing
        assert pyarrow.table(columns).column_names == list(columns), name
    run = results["recording"]
    recorded, (trial,) = tables["recording"], pamsim.read_recordings(folder / "recording").trials
    np.testing.assert_array_equal(recorded["time"], run.time)
    np.testing.assert_array_equal(recorded["pressure_2"], run.pressure[:, 1])
    for channel in ("time", "angle", "pressure_2"):
        np.testing.assert_allclose(pamsim.table(trial)[channel], recorded[channel], rtol=1e-6)
    (damping,) = rows_of(tables["calibration"])
    (known,) = results["calibration"].to_dict()["parameters"]
    assert damping["parameter"] == "joint.shaft.damping"
    assert (damping["value"], damping["unit"]) == (known["value"], "N*m*s/rad")
    assert known["interval95"] is None  # of a search that was not finished
    assert math.isnan(damping["low"])
    assert damping["before"] == pytest.approx(0.3247)
    for name in ("fit", "identification"):
        result, rows = results[name], rows_of(tables[name])
        fits = result.fits if name == "fit" else result.candidates
        assert list(dict.fromkeys(row["model"] for row in rows)) == [
            getattr(one, "model", None) or one.name for one in fits
        ]
        without = [row for row in rows if math.isnan(row["low"])]
        assert all(math.isnan(row["high"]) for row in without)
        assert all(row["low"] <= row["value"] <= row["high"] for row in rows if row not in without)
    for name in ("diagnosis of recordings", "diagnosis of a loop"):
        found = results[name].to_dict()["effects"]
        sizes = {(e["effect"], p): (e["level"], s) for e in found for p, s in e["sizes"].items()}
        rows = {(row["effect"], row["parameter"]): row for row in rows_of(tables[name])}
        assert list(rows) == list(sizes)
        for at, (level, size) in sizes.items():
            assert (rows[at]["level"], rows[at]["unit"]) == (level, size["unit_si"])
            assert rows[at]["value"] == size["value_si"]
    with pytest.raises(InputError, match="no table of a SyntheticRecording; help"):
        pamsim.table(results["synthetic recording"])


def test_a_saved_recording_is_read_back(results, folder):
    (trial,) = pamsim.read_recordings(folder / "recording").trials
    assert trial.name == "a_step"


def test_an_effect_states_what_measures_it_and_not_its_shape(results):
    (loop,) = results["diagnosis of a loop"].effects
    assert loop.measured_by == ("bouc_wen.opening",)
    assert loop.sizes.keys() > set(loop.measured_by)
