"""Each figure draws what its result holds, whole and in the unit of its axis, and nothing else."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.comparison.compared_signal import Comparison
from pamsim.recordings.printed import mas20_steps
from pamsim.report.check_page import visible_sizes
from pamsim.report.film import gap_sheet
from pamsim.report.fit_figure import fit_figure
from pamsim.report.identify_page import bode, measured_and_model, steps_and_poles
from pamsim.report.link_page import learned_curves
from pamsim.report.reproduce_figures import errors_by_row, pressure_courses
from pamsim.report.step_figure import step_figure
from pamsim.report.sweep_figure import sweep_figure
from pamsim.report.trial_signals import trial_channels
from tests.unit.identification.planted import identified_lag
from tests.unit.papers.made_up_rows import course, row
from tests.unit.report.figure_laws import check_figure, draws

BAR, UP, SCATTER = (
    np.array([3.0, 1.0, 2.0]),
    np.argsort([3.0, 1.0, 2.0]),
    np.array([1.0, -4.0, 2.0]),
)
KPA = 100.0 * BAR[UP]
TIME = np.linspace(0.0, 2.0, 41)
LARGE, SMALL = (row(step, course(step, 0.01)) for step in np.array(mas20_steps())[[0, 15]])


def fitted(kind, unit, *parts, **points):
    """A result of `pamsim.fit` whose fits miss what was measured by `SCATTER`."""
    scores = {"points": 3, "free": 2, "rmse": 2.5}
    law = {"title": "law", "unit": unit, "scores": scores, "held_out": None}
    return {"kind": kind, "fits": [{**law, "part": part, "points": points} for part in parts]}


def force_map():
    force = np.array([100.0, 20.0, 60.0])
    near, far = {"contraction": 0.0, "force": force}, {"contraction": 0.1, "force": force - 10.0}
    result = fitted(
        "force_map", "N", "",
        pressure=np.tile(1e5 * BAR, 2), contraction=np.repeat([0.0, 0.1], 3),
        measured=np.concatenate([one["force"] for one in (near, far)]),
        predicted=np.concatenate([one["force"] + SCATTER for one in (near, far)]),
    )  # fmt: skip
    held = {"by": "pressure", "rmse": 4.0, "worst": 5.0, "residual": [*(2.0 * SCATTER), None, 1, 1]}
    result["fits"][0]["held_out"] = held
    forces = [one["force"][UP] for one in (near, far)]
    above = [(KPA, one) for one in forces] + [(KPA, one + SCATTER[UP]) for one in forces]
    below = [SCATTER[UP], 2.0 * SCATTER[UP], [1.0, 1.0, np.nan]]
    figure = fit_figure(result)
    assert figure.axes[1].get_title(loc="left") == (
        "filled: in-sample, 2.5 N RMS; hollow: that pressure held out, 4.0 N RMS"
    )
    return figure, [above, [(KPA, one) for one in below]]


def length_loop():
    length = np.array([0.27, 0.30, 0.28])
    result = fitted(
        "length_loop", "m", "up",
        pressure=1e5 * BAR, measured=length, predicted=length + 1e-3 * SCATTER,
    )  # fmt: skip
    mm = 1e3 * length[UP]
    return fit_figure(result), [[(KPA, mm), (KPA, mm + SCATTER[UP])], [(KPA, SCATTER[UP])]]


def force_loops():
    points = {"frequency": np.repeat(2.0 * np.pi * BAR, 2), "predicted": np.arange(6.0)}
    return fit_figure(fitted("force_loops", "N", "", **points)), [
        [(BAR, [0.0, 2.0, 4.0]), (BAR, [1.0, 3.0, 5.0])]
    ]


def sweep():
    columns = {"mass": BAR, "rig": np.array(["b", "a", "c"]), "turn": SCATTER}
    columns |= {"final": 2.0 * BAR, "gain": -BAR}
    outputs = {"final": SimpleNamespace(unit="deg"), "gain": SimpleNamespace(unit="1")}
    figure = sweep_figure(
        SimpleNamespace(
            columns=lambda: columns, outputs=outputs, runs=3,
            rank_correlations={"final": {"mass": 0.1, "turn": -0.9}, "gain": {"mass": 0.2}},
            factors={"mass": "kg", "rig": "", "turn": "1"},
        )
    )  # fmt: skip
    assert [ax.get_xlabel() for ax in figure.axes] == ["", "", "", "rig", "turn", "mass\n[kg]"]
    assert [ax.get_ylabel() for ax in figure.axes] == ["final [deg]", "", "", "gain", "", ""]
    factors = ([1.0, 0.0, 2.0], SCATTER, BAR)  # what matters first
    return figure, [[(x, y)] for y in (2.0 * BAR, -BAR) for x in factors]


def check():
    effects = [
        {"name": name, "shows_from": size, "typical": 2.0, "seen": seen}
        for name, size, seen in zip(
            "abcdef", (0.2, 0.4, 1.0, 4.0, 9e9, None), [True] * 3 + [False] * 3, strict=True
        )
    ]
    figure = visible_sizes(effects)
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == list("abcdef")
    assert figure.axes[0].lines[-1].get_xdata() == [1, 1]  # the typical size
    return figure, [[([0.1, 0.2, 0.5], range(3)), ([2.0, 1e3, 1e3], range(3, 6))]]


def step():
    run = LARGE.recording
    force = [(run.time, tension) for tension in run.tension.T]
    angle = [(run.time, np.degrees(run.angle))]
    figure = step_figure(run)
    labels = ["angle β [deg]", "gauge pressure [kPa]", "tension [N]"]
    assert [ax.get_ylabel() for ax in figure.axes] == labels
    return figure, [angle, [(run.time, p / 1e3) for p in run.pressure.T], force]


def pressures():
    rows, runs = [one.to_dict() for one in (LARGE, SMALL)], [LARGE.recording, SMALL.recording]
    recordings = {one["row"]: run for one, run in zip(rows, runs, strict=True)}
    wanted = [[(run.time, p / 1e3) for p in run.pressure.T] for run in runs]
    figure = pressure_courses(rows, recordings)
    assert [ax.get_ylabel() for ax in figure.axes] == ["gauge pressure [kPa]", ""]
    ends = [[line.get_ydata()[0] for line in ax.lines if len(line.get_xdata()) == 1]
            for ax in figure.axes]  # fmt: skip
    assert ends == [[one["p1_kpa"], one["p2_kpa"]] for one in rows]
    return figure, wanted


def errors():
    rows = [one.to_dict() for one in (LARGE, SMALL, LARGE)]
    rows = [{**rows[i % 3], "row": i + 1, "error_deg": float(i % 4 - 1)} for i in range(9)]
    figure = errors_by_row(rows, 2.0)
    large, small = ([one for one in rows if one["size"] == size] for size in ("large", "small"))
    above = [([r["row"] for r in some], [r["error_deg"] for r in some]) for some in (large, small)]
    bars = {round(bar.get_center()[0]): bar.get_height() for bar in figure.axes[1].patches}
    assert bars == pytest.approx({one["row"]: abs(one["measured_deg"]) for one in rows})
    return figure, [above, []]


def identification():
    result, curves = identified_lag().to_dict(), identified_lag().curves()
    model, (one,), poles = curves.bodes[0], curves.steps, result["models"][0]["poles_rad_per_s"]
    figure, hertz = bode(result, curves), model.frequency / (2.0 * np.pi)
    for ax in figure.axes:
        (corner,) = (line for line in ax.lines if line.get_transform() != ax.transData)
        assert corner.get_xdata()[0] == pytest.approx(abs(poles[0][0]) / (2.0 * np.pi))
    shorter = bode(result, replace(curves, nyquist=10.0 * np.pi)).axes[1]
    assert shorter.get_xlim() == pytest.approx((hertz[0], 5.0))  # where sampling ends
    yield figure, [[(hertz, model.magnitude)], [(hertz, np.degrees(model.phase))]]
    yield steps_and_poles(result, curves), [[(one.time, one.output)], []]
    fitted, held = curves.trials
    wanted = [
        part
        for t in (held, fitted)
        for part in ([(t.time, t.output), (t.time, t.model)], [(t.time, t.model - t.output)])
    ]
    figure = measured_and_model(result, curves)
    assert [ax.get_xlabel() for ax in figure.axes] == ["", "", "time [s]", "time [s]"]
    yield figure, wanted


def compared():
    """A joint [rad] and a pressure [Pa] of one trial, and the film of the joint."""
    shapes = {"angle": 0.3 * np.sin(3.0 * TIME), "pressure_1": 1e5 * TIME}
    parts = [
        Comparison(
            trial="one", protocol="one", channel=name, held_out=True, time=TIME,
            measured=values, before=0.8 * values, after=1.1 * values,
        )
        for name, values in shapes.items()
    ]  # fmt: skip
    shown = np.degrees(shapes["angle"]), shapes["pressure_1"] / 1e3
    wanted = [
        [(TIME, share * values) for share in shares]
        for values in shown
        for shares in ((1.0, 0.8, 1.1), (0.2, -0.1))
    ]
    figure = trial_channels(parts, {"angle": 0.02, "pressure_1": 4e3})
    for ax, band in zip(figure.axes[1::2], (2.0 * np.degrees(0.02), 8.0), strict=True):
        assert ax.patches[0].get_extents().transformed(ax.transData.inverted()).intervaly == (
            pytest.approx([-band, band])
        )
    yield figure, wanted
    sheet, _ = gap_sheet(parts[0])
    (ax,) = sheet.curves
    assert ax.get_ylabel() == "angle [deg]"
    ax.lines[-1].remove()  # the cursor
    yield ax.get_figure(root=True), wanted[:1]


def learned():
    one = {
        "at": 100.0 * BAR[UP], "value": SCATTER, "band95": [[a - 1.0, a + 1.0] for a in SCATTER],
        "over": "pressure", "acts_at": "muscle", "joint": "", "where": "muscle",
        "at_unit": "kPa", "unit": "N*s/m", "kind": "a friction over pressure",
    }  # fmt: skip
    arm = one | {
        "joint": "shaft",
        "where": "shaft, at muscle",
        "unit": "%",
        "kind": "an arm over it",
    }
    figure = learned_curves([one, arm])
    labels = [(ax.get_xlabel(), ax.get_ylabel()) for ax in figure.axes]
    assert labels == [
        ("pressure of muscle [kPa]", "friction [N s/m]"),
        ("pressure of shaft [kPa]", "arm of muscle [%]"),
    ]
    return figure, [[(KPA, SCATTER)]] * 2


@pytest.mark.parametrize(
    "made",
    [force_map, length_loop, force_loops, sweep, check, step, pressures, errors,
     identification, compared, learned],
)  # fmt: skip
def test_a_figure_draws_what_its_result_holds_in_the_unit_of_its_axis(made):
    cases = made()
    for figure, wanted in [cases] if isinstance(cases, tuple) else cases:
        for ax, each in zip(figure.axes, wanted, strict=True):
            assert draws(ax, *each), ax.get_ylabel()
        check_figure(figure)
