"""identify as a function: arguments in, one object out, with text, dict, files and a figure."""

import json
from dataclasses import replace

import numpy as np
import pytest

from pamsim.identification.identify import identify
from pamsim.identification.local_models import LocalModelMap, dependence
from pamsim.identification.model import estimates_of
from pamsim.identification.summary import summary_lines
from pamsim.recordings.trial import TrialSet
from pamsim.report.identify_page import measured_and_model
from tests.unit.identification.planted import (
    FEW,
    GAIN,
    LAG,
    TS,
    identified_lag,
    log,
    record,
    refuses,
    sampled,
    steps,
    trial,
)


@pytest.fixture(scope="module")
def result():
    return identified_lag()


def test_the_result_holds_models_in_si_and_writes_them_in_the_units_of_the_columns(result):
    assert result.recommendation.name == "first_order"
    fit = result.shown.fit
    assert fit.gain == pytest.approx(GAIN, rel=0.02)
    assert fit["T"].value == pytest.approx(LAG, rel=0.02)
    assert [score.name for score in fit.held_out] == ["telegraph_2"]
    (written, *_) = json.loads(json.dumps(result.to_dict(), allow_nan=False))["models"]
    gain, in_columns = written["parameters"]["K"], fit.gain * 1e3 * 180.0 / np.pi
    assert gain["unit"] == "deg/kPa"
    assert gain["value"] == pytest.approx(in_columns, rel=1e-12)
    assert written["trials"][0]["rms"] == pytest.approx(np.degrees(5e-4), rel=0.1)
    system, in_si = result.transfer_function(), result.transfer_function(si=True)
    assert float(in_si.dcgain()) == pytest.approx(fit.gain)
    assert float(system.dcgain()) == pytest.approx(in_columns, rel=1e-12)
    assert float(system.poles()[0].real) == pytest.approx(-1.0 / fit["T"].value)
    text = result.summary()
    assert "* first_order: fits" in text
    assert all(f"  {name}: fits" in text for name in ("arx_1_1_1", "oe_1_1_1"))
    assert "recommended: first_order: the only model" in text
    assert "deg/kPa  [" in text


def test_files_and_figure_show_every_trial(result, tmp_path):
    files = result.save(tmp_path / "new")
    assert [path.name for path in files] == ["identify.json", "curves.csv"]
    assert json.loads(files[0].read_text())["schema"] == "pamsim-identify/4"
    rows = files[1].read_text().splitlines()
    assert rows[0] == "trial,time_s,input_kpa,output_deg,model_deg"
    assert {row.split(",")[0] for row in rows[1:]} == {"telegraph_1", "telegraph_2"}
    (tmp_path / "file").write_text("")
    refuses("cannot write", result.save, tmp_path / "file")
    figure = measured_and_model(result.to_dict(), result.curves())
    assert len(figure.axes) == 4  # two trials, each with its residual


def test_a_drift_is_estimated_and_printed_in_the_unit_of_the_column(tmp_path):
    draw = np.random.default_rng(5)
    given = steps(draw, 300, 20, rest=0)
    output = sampled([10.0], [0.2, 1.0], given, TS)
    output = output + np.linspace(0.0, 6.0, 300) + 0.2 * draw.normal(size=300)
    path = log(tmp_path / "log.csv", "time_s,valve,travel_mm", TS * np.arange(300), given, output)
    found = identify(path, **{**FEW, "order": None})
    assert found.recommendation.best == "first_order_drift"  # instead of more poles
    assert found.shown.fit["T"].value == pytest.approx(0.2, rel=0.05)
    assert found.recommendation.reason.startswith("1 pole, drift: the best by the Hannan-Quinn")
    (line,) = [s for s in found.summary().splitlines() if "drift of the output" in s]
    unit, _, rest = line.partition(": ")
    value, _, trial = rest.split()
    assert unit.endswith("[mm]")
    assert float(value) == pytest.approx(6.0, abs=0.3)
    assert trial == "log"
    assert found.to_dict()["scan"]["structures"][0]["hannan_quinn_above_best"] > 0.0


def test_an_end_that_is_not_bounded_is_null_in_json_and_words_in_text(result):
    fit = result.shown.fit
    vague = replace(fit, covariance=np.diag([900.0, 0.0]))  # of ln T, and of the gain
    estimates = estimates_of(vague.structure, vague, vague.unit_output, vague.units_input)
    assert estimates[1].interval95 == (0.0, np.inf)
    candidate = replace(result.shown, fit=replace(vague, estimates=estimates))
    found = replace(result, candidates=(candidate,), local=None)
    written = json.loads(json.dumps(found.to_dict(), allow_nan=False))["models"][0]
    assert written["parameters"]["T"]["interval95"] == [0.0, None]
    assert "s  [0, not bounded]" in found.summary()


def test_trends_over_a_map_are_written_in_the_units_of_its_points(result):
    """A trend of a logarithm times its span has no unit."""
    over = {"pressure": 1e5 * np.arange(5.0), "load": np.array([0.0, 2.0, 1.0, 0.0, 0.5])}
    noise = 0.01 * np.random.default_rng(0).normal(size=5)
    values = np.log(LAG) + 1e-6 * over["pressure"] - 0.2 * over["load"] + noise
    item = dependence("T", values, np.full(5, 0.01), over, logarithmic=True)
    found = replace(result, local=LocalModelMap((), (item,)))
    written = found.to_dict()["local"]["dependences"][0]["trends"]
    for name, unit, span in (("pressure", "kPa", 400.0), ("load", "kg", 2.0)):
        trend, shown = item.trends[name], written[name]
        assert (shown["per"], shown["span"]) == (unit, pytest.approx(span))
        assert shown["slope"] * span == pytest.approx(trend.slope * trend.span)
        ends = [end * trend.span / span for end in trend.interval95]
        assert shown["interval95"] == pytest.approx(ends)
    # A gain's own unit is that of the columns, too.
    over = {"amplitude": 1e4 * np.arange(5.0)}
    item = dependence(
        "K", GAIN * (1.0 + 1e-5 * over["amplitude"]), np.full(5, 1e-8), over, logarithmic=False
    )
    found = replace(result, local=LocalModelMap((), (item,))).to_dict()["local"]
    per_column = 1e3 * 180.0 / np.pi  # deg/kPa of rad/Pa
    assert found["dependences"][0]["mean"] == pytest.approx(1.2 * GAIN * per_column)
    shown = found["dependences"][0]["trends"]["amplitude"]
    assert (shown["per"], shown["span"]) == ("kPa", pytest.approx(40.0))
    assert shown["slope"] == pytest.approx(GAIN * per_column * 1e-5 * 1e3)


def test_a_dead_time_that_one_of_several_inputs_does_not_have_is_none_in_the_text(result):
    written = result.to_dict()
    absent = {"value": 0.0, "unit": "s", "interval95": [0.0, 0.02]}
    written["models"][0]["parameters"] = {"L[1]": {**absent, "value": 0.01}, "L[2]": absent}
    text = "\n".join(summary_lines(written))
    assert text.count("s  [0, 0.02]") == 1
    assert "L[2] none; below 0.02 s" in text


def test_another_day_is_predicted_from_its_inputs_alone(result):
    day = trial("day", 3)
    moved = replace(day, measured={**day.measured, "angle": day.measured["angle"] + 0.3})
    (found,) = result.predict(TrialSet(rig="mas20_arm", trials=(day,)))
    (same,) = result.predict(TrialSet(rig="mas20_arm", trials=(moved,)))
    np.testing.assert_array_equal(found.model, same.model)
    assert np.degrees(0.3) == pytest.approx(np.mean(same.output - found.output))
    # Nothing is fitted, so that what is left is the noise and the error of the level.
    assert np.sqrt(np.mean((found.model - found.output) ** 2)) == pytest.approx(
        np.degrees(5e-4), rel=0.2
    )
    fit, record = result.shown.fit, result.used[0].record
    shifted = replace(record, inputs=record.inputs + 1e5)
    assert fit.predict(shifted) - fit.predict(record) == pytest.approx(fit.gain * 1e5)
    refuses("no output at rest", replace(fit, level=None).predict, record)
    still = replace(day, command=np.broadcast_to(day.command[0], day.command.shape))
    (held,) = result.predict(TrialSet(rig="mas20_arm", trials=(still,)))
    np.testing.assert_allclose(held.model, held.model[0])
    other = replace(day, measured={"pressure_1": day.command[:, 0]})
    refuses("no column 'angle_deg'", result.predict, TrialSet(rig="x", trials=(other,)))


def test_an_output_that_leads_its_input_is_no_absent_dead_time(tmp_path):
    draw = np.random.default_rng(6)
    given = np.repeat(draw.uniform(-1.0, 1.0, 40), 10)
    output = sampled([10.0], [0.1, 1.0], np.append(given, 0.0), TS)[1:]
    output += 0.1 * draw.normal(size=400)
    path = log(tmp_path / "log.csv", "time_s,valve,travel_mm", TS * np.arange(400), given, output)
    found = identify(path, **{**FEW, "dead_time": "free"})
    assert "L    none; the output leads the input" in found.summary()
    assert "the output leads the input; check the order of the rows" in found.shown.fit.sentence
    assert found.shown.fit["L"].interval95 == (0.0, 0.0)


def test_a_rate_of_poles_is_no_gain_from_an_input_in_seconds(tmp_path):
    draw = np.random.default_rng(8)
    given = np.repeat(draw.uniform(0.0, 0.1, 20), 20)
    output = np.degrees(sampled([36.0 * 4.0], [1.0, 3.6, 36.0], given, TS))
    output += 0.01 * draw.normal(size=400)
    path = log(tmp_path / "log.csv", "time_s,pulse_s,angle_deg", TS * np.arange(400), given, output)
    found = identify(path, **{**FEW, "order": 2}, poles="any").to_dict()["models"][0]["parameters"]
    assert found["K"]["value"] == pytest.approx(np.degrees(4.0), rel=0.01)
    assert found["wn"]["value"] == pytest.approx(6.0, rel=0.01)
    assert (found["K"]["unit"], found["wn"]["unit"]) == ("deg/s", "rad/s")


def test_the_gain_from_a_flow_is_per_the_whole_unit_of_the_flow(tmp_path):
    given = record(7, constants=(LAG,), gain=2.0, noise=0.01, n=400)
    columns = given.time, given.input, given.output
    path = log(tmp_path / "log.csv", "time_s,flow [l/min],force [lbf]", *columns)
    found = identify(path, **FEW)
    assert found.shown.fit["K"].unit == "N/(l/min)"
    assert found.to_dict()["models"][0]["parameters"]["K"]["unit"] == "lbf/(l/min)"


def test_a_part_of_a_trial_does_not_begin_at_rest(tmp_path):
    given = record(9, noise=0.01)
    path = log(tmp_path / "log.csv", "time_s,u,y", given.time, given.input, given.output)
    refuses("`start` rest: log_end is a part", identify, path, **FEW, start="rest", hold_out=0.3)


def test_another_day_in_other_units_is_converted_or_refused(tmp_path):
    given = record(7, constants=(LAG,), gain=2.0, noise=0.01, n=400)
    columns = given.time, given.input, given.output

    def written(name, units, factor):
        rows = zip(columns[0], factor * columns[1], columns[2], strict=True)
        lines = ["time_s,u,y", units, *(",".join(map(repr, map(float, row))) for row in rows)]
        (tmp_path / name).write_text("\n".join(filter(None, lines)))
        return tmp_path / name

    found = identify(written("kpa.csv", "s,kPa,deg", 100.0), **FEW)
    same, other = (
        found.predict(path)[0].model
        for path in (written("kpa.csv", "s,kPa,deg", 100.0), written("bar.csv", "s,bar,deg", 1.0))
    )
    np.testing.assert_allclose(other, same, rtol=1e-9)
    refuses("'y' is in mm, in the fitted", found.predict, written("mm.csv", "s,kPa,mm", 100.0))
    refuses("'u' is in 1, in the fitted", found.predict, written("none.csv", "", 100.0))


def test_the_step_response_of_a_late_gain_shows_its_dead_time(tmp_path):
    given = np.random.default_rng(5).choice([-1.0, 1.0], 40).repeat(10)
    late = np.append(np.full(3, given[0]), given[:-3])
    path = log(tmp_path / "late.csv", "time_s,u,y", 0.1 * np.arange(400), given, 2.0 * late)
    found = identify(path, **{**FEW, "order": 0, "dead_time": "free"})
    (step,) = found.curves().steps
    assert np.mean(step.output == 0.0) > 0.1
