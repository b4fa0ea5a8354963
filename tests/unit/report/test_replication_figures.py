"""The papers' figures: the curves are those of the printed laws, and all of them are drawn."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.papers.replicate import Replication, replication_figures
from pamsim.report.replication_figures import FIGURES
from pamsim.report.replication_page import write_replication
from tests.unit.papers.second_route.printed_files import column, rows
from tests.unit.report.figure_laws import check_figure, courses, same

approx = pytest.approx
STEPS, TABLE = rows("matiskova2021_steps.csv"), rows("alraouf2025_table2.csv")
LOOP = {  # (3), (4)
    "up": (2.7378, -0.0083212, 1.3402, 27.759),
    "down": (2.7854, -0.0088259, 1.1891, 27.87),
}
CUT = ("$f_{t0}$", "(1) ideal", "(2)", "(4)", "held at a length", "Figure 3")
"""Axes that end where the muscle would push, or where (2) no longer holds."""
ASIDE = ("history", "half_interval_cm", "width_mm", "wen_residual_cm", "passive_residual_cm")
"""Stated in words, drawn as bars, or added to the means."""
BANDS = {  # x and y from and to; across a whole panel from 0 to 1
    "alraouf2025": {(0.0, -0.3, 1.0, 0.3)},
    "vandamme2008": {(7.0, 0.0, 20.0, 1.0), (5.0, 0.0, 35.0, 1.0)},
}


@pytest.fixture(scope="module")
def curves():
    return replication_figures(FIGURES)


def arrays(tree, path=""):
    """Every curve by its place in a nested mapping; a loop gives two."""
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from arrays(value, f"{path}/{key}")
        elif np.ndim(value) == 1 or isinstance(value, tuple):
            both = (value,) if np.ndim(value) == 1 else value
            for part, one in enumerate(both):
                if len(one) > 2:
                    yield f"{path}/{key}/{part}", np.asarray(one, dtype=float)


def points(x, y):
    """The points of a course that exist, without what rounding changes."""
    return {pair for pair in zip(np.round(x, 9), np.round(y, 9), strict=True) if pair[1] == pair[1]}


def derived(paper, own):
    """Courses that captions state beside the curves themselves."""
    if paper == "matiskova2021":
        for size in ("large", "medium", "small"):
            some = [row for row in STEPS if row["size"] == size and not row["repeats"]]
            yield [float(r["p1_kpa"]) - float(r["p2_kpa"]) for r in some], column(some, "beta_deg")
    if paper == "alraouf2025":
        for branch, aside in (("up", -3.0), ("down", 3.0)):  # kPa
            mean = own[branch]["mean_cm"]
            yield own["pressure_kpa"] + aside, mean
            for model in ("bouc_wen", "passive"):
                yield own["pressure_kpa"], mean + own[branch][f"{model}_residual_cm"]
    if paper == "vandamme2008":
        x, exact, polynomial = (
            np.array(own["exact"][k]) for k in ("contraction_percent", "exact", "polynomial")
        )
        yield x[exact > 0.02], (100.0 * (polynomial - exact) / exact)[exact > 0.02]


@pytest.mark.parametrize("paper", FIGURES)
def test_every_curve_is_drawn_whole_over_its_own_axis_and_nothing_else(curves, paper):
    known, others = dict(arrays(curves[paper])), list(derived(paper, curves[paper]))
    seen, drawn = {name: set(np.round(one, 9)) for name, one in known.items()}, set()
    for name, draw in FIGURES[paper].items():
        figure = draw(curves[paper])
        check_figure(figure, CUT)
        for ax in figure.axes:
            across = [line.get_data() for line in ax.lines if line.get_transform() != ax.transData]
            assert all(x[0] == x[1] == 0.0 or y[0] == y[1] == 0.0 for x, y in across)
            for x, y in courses(ax):
                if any(same((x, y), other) for other in others):
                    continue
                places, values = (set(np.round(one[y == y], 9)) for one in (x, y))
                pairs = [
                    (b, a)
                    for a in known
                    if values <= seen[a]
                    if np.nanmax(known[a]) - np.nanmax(y) < 0.1 * np.ptp(y[y == y])
                    for b in known
                    if places <= seen[b] and len(known[a]) == len(known[b])
                    if points(x, y) <= points(known[b], known[a])
                ]
                assert pairs, (name, ax.get_title(loc="left"), ax.get_ylabel())
                drawn |= {one for pair in pairs for one in pair}
    left = [key for key in set(known) - drawn if not any(words in key for words in ASIDE)]
    assert left == [], left
    bands = {
        tuple(patch.get_path().get_extents(patch.get_patch_transform()).extents.round(6).tolist())
        for draw in FIGURES[paper].values()
        for ax in draw(curves[paper]).axes
        for patch in ax.patches
    }
    assert bands == BANDS.get(paper, set())


@pytest.mark.usefixtures("quick")
def test_page_has_the_figures_of_the_papers_asked_for_and_their_captions(curves, tmp_path):
    empty = Replication(papers={}, claims=(), notes=(), failures=(), wall_s=0.0).to_dict()
    chosen = {paper: curves[paper] for paper in ("nguyen2024", "sarosi")}
    source = write_replication(empty, chosen, tmp_path).read_text(encoding="utf-8")
    drawn = {name for paper in chosen for name in FIGURES[paper]}
    assert {path.stem for path in tmp_path.glob("*.png")} == drawn
    assert source.count("<figure") == 6
    assert source.count("Assumed") == 5  # the inverse shares the constants of the laws above it
    assert "matiskova2021_static" not in source


def test_curves_of_matiskova_and_alraouf_are_the_printed_laws_and_tables(curves):
    own, (a0, a1, a2) = curves["matiskova2021"], (35.135, -34.4443, 5.470)  # (23)
    x = np.array(own["p_svd_kpa"])
    assert x == approx(-x[::-1])
    assert x[-1] > max(map(abs, column(STEPS, "p_svd_kpa")))
    for name, unit in (("bar", 100.0), ("scaled", own["scale_kpa"])):
        size = np.abs(x) / unit
        angle = np.sign(x) * (a0 + (a1 + a2 * size) * np.exp(-size))
        assert own[f"eq23_{name}_deg"] == approx(angle, abs=1e-9)
    own = curves["alraouf2025"]
    at, fine = own["pressure_kpa"], own["fine_kpa"]
    assert fine[[0, -1]] == approx([0.0, 500.0])
    for branch, (a0, a1, a2, a3) in LOOP.items():
        one = own[branch]
        assert one["mean_cm"] == approx(column(TABLE, f"{branch}_mean_cm"))
        assert one["half_interval_cm"] == approx(column(TABLE, f"{branch}_ci_cm"))
        assert one["published_cm"] == approx(a0 * np.arctan(a1 * fine + a2) + a3)
        for name in ("published", "refitted"):
            drawn = np.interp(at, fine, one[f"{name}_cm"])
            assert one[f"{name}_residual_cm"] == approx(drawn - one["mean_cm"], abs=1e-9)
        # Least squares with an offset leaves a mean of zero.
        assert one["refitted_residual_cm"].mean() == approx(0.0, abs=1e-6)
    for key, width in own["width_cm"].items():
        up, down = (own[branch][f"{key}_residual_cm"] for branch in LOOP)
        assert np.mean(up + down) == approx(0.0, abs=1e-6)
        apart = up + own["up"]["mean_cm"] - down - own["down"]["mean_cm"]
        assert np.max(np.abs(apart)) == approx(width, abs=1e-9)


def test_loops_of_nguyen_have_the_stiffness_and_the_loss_drawn_below_them(curves):
    own = curves["nguyen2024"]
    loops = [(float(name.split()[0]), 3.5, loop) for name, loop in own["by_amplitude"].items()]
    loops += [(125.0, float(name.split()[0]), loop) for name, loop in own["by_frequency"].items()]
    for amplitude, hertz, (x, force) in loops:
        stiffness, loss = (
            np.interp(hertz, own["frequency_hz"], own[k])
            for k in ("stiffness_n_per_m", "loss_percent")
        )
        assert force.max() == approx(amplitude, rel=1e-3)
        assert x.max() == approx(1e3 * amplitude / stiffness, rel=1e-3)
        assert x[0] == approx(-0.01 * loss * x.max(), rel=1e-3)  # the force leads
        assert (x[-1], force[-1]) == approx((x[0], force[0]), abs=1e-9)
    for order, (x, force) in own["by_order"].items():
        u = 4.0 / 3.0 * 9.0 ** float(order) * np.exp(0.5j * np.pi * float(order))
        assert np.trapezoid(force, x) == approx(
            1e3 * np.pi * 2500.0**2 * -(1.0 / (150000.0 * u / (1.0 + u))).imag, rel=1e-3
        )
        assert force.max() == approx(2500.0, rel=1e-3)
    bench = own["bench"]
    for label, each in bench["loops"].items():
        at = list(bench["frequency_hz"]).index(float(label.split()[0]))
        x = each["displacement_mm"]
        assert x.max() == approx(2.0, rel=1e-3)
        for key, of in (("law_n", "law"), ("force_n", "engine")):
            assert np.trapezoid(each[key], x) == approx(bench["area_mj"][of][at], rel=2e-3)
        assert each["force_n"] == approx(each["law_n"], abs=0.01 * each["law_n"].max())


def test_curves_of_van_damme_are_the_weight_5_the_error_6_and_the_force_7(curves):
    own = curves["vandamme2008"]
    plane, major, x = own["plane"], own["major"], own["contraction_percent"]
    alpha, beta = np.meshgrid(plane["levels"], plane["levels"], indexing="ij")
    weight = np.exp(-((beta - alpha + 0.1) ** 2) - (np.abs(alpha + beta) - 1.0) ** 2)
    weight[alpha < beta] = 0.0
    assert plane["weight"] == approx(weight / weight.max())
    # A relay is up if it was switched up after it was last switched down.
    turns = np.array(plane["history"])[:, None, None]
    assert np.all(np.diff(np.abs(np.diff(turns.flat))) < 0.0)  # each leaves a step
    times = np.arange(len(turns))[:, None, None]
    rose, fell = (
        np.max(np.where(hit, times, -1), axis=0) for hit in (turns >= alpha, turns < beta)
    )
    (mesh,) = FIGURES["vandamme2008"]["vandamme2008_plane"](own).axes[0].collections[:1]
    drawn = mesh.get_array()
    assert np.array_equal(np.ma.getmaskarray(drawn), alpha < beta)
    assert np.ma.allclose(drawn, plane["weight"])
    assert np.array_equal(plane["relays"][alpha >= beta] > 0.0, (rose > fell)[alpha >= beta])
    assert major["rising"][0] == approx(-1.0, abs=0.03)  # half a cell inside of saturation
    assert major["falling"] == approx(-major["rising"][::-1], abs=1e-12)
    beside = major["rising"] + major["falling"] - 2.0 * major["line"]
    assert beside @ major["input"] == approx(0.0, abs=1e-9)  # least squares over both branches
    assert np.ptp(major["line"] / major["input"]) < 1e-12
    way_out = np.arange(len(x)) <= np.argmax(x)
    assert x[[0, -1]] == approx([5.25, 5.25])
    assert x.max() == approx(35.0)
    u = 2.0 * x / 35.0 - 1.0
    error = np.where(
        way_out,
        *(np.interp(u, major["input"], major[b] - major["line"]) for b in ("rising", "falling")),
    )
    exact = own["exact"]
    static = np.interp(x, exact["contraction_percent"], exact["polynomial"])
    assert own["static"] == approx(static, rel=2e-3)
    for fibres, delta in (("40", 0.299), ("25", 0.139)):
        loop = own["loops"][fibres]
        assert loop["delta"] == delta
        assert (loop["value"] / own["static"] - 1.0) / delta == approx(error, abs=2e-2), fibres
        assert loop["inner_percent"].min() == approx(7.0)
        assert loop["inner_percent"].max() == approx(20.0)
    for label, force in own["forces"].items():
        pressure = 1e5 * float(label.split()[0])
        assert force == approx(pressure * 0.06**2 * own["loops"]["25"]["value"])
    bench = own["bench"]
    whole = bench["contraction_percent"][slice(*bench["whole"])]
    assert [whole[0], whole.min(), whole[-1]] == approx([35.0, 5.0, 35.0])
    for label, force in bench["static_n"].items():
        assert force == approx(1e5 * float(label.split()[0]) * 0.06**2 * bench["fit"])
        error = 100.0 * (bench["force_n"][label] / force - 1.0)
        assert error == approx(bench["loops"]["25"]["error_percent"], abs=1e-6)
    for loop in bench["loops"].values():
        assert 100.0 * (loop["function"] / bench["fit"] - 1.0) == approx(loop["error_percent"])


def test_curves_of_sarosi_are_1_and_4_and_what_is_fitted_to_4(curves):
    own = curves["sarosi"]
    kappa, bars = own["contraction_percent"], np.arange(1, 7)
    assert kappa[[0, -1]] == approx([0.0, 25.0])
    ideal, corrected, printed = (
        np.array([own[law][f"{bar} bar"] for bar in bars])
        for law in ("ideal", "corrected", "exponential")
    )

    def exponential(bar):
        fall = (-4.00180705 * bar + 292.4620246) * np.exp(-0.32930845 * kappa)
        return fall + (294.0538256 - 9.33564098 * kappa) * bar - 280.498151

    assert printed == approx(np.array([exponential(bar) for bar in bars]), abs=1e-6)
    tangent, sine = (of(np.radians(28.6)) for of in (np.tan, np.sin))
    shape = 3.0 / tangent**2 * (1.0 - kappa / 100.0) ** 2 - 1.0 / sine**2
    assert ideal == approx(np.outer(1e5 * bars, np.pi * 0.01**2 * shape), abs=1e-6)
    end = 100.0 - 100.0 * np.sqrt(1.0 / 3.0) * tangent / sine
    assert own["ideal_end_percent"] == approx(end)
    fitted = printed[1:, ::5] > 0.0
    miss = (corrected - printed)[1:, ::5][fitted]
    assert np.sqrt(np.mean(miss**2)) == approx(own["fit"]["rms_n"], rel=1e-6)
    assert own["fit"]["rms_n"] < 40.0
    assert own["round_trip_bar"] < 1e-9
    for label, bar in own["inverse"].items():
        wanted, known = float(label.split()[0]), np.isfinite(bar)
        assert exponential(bar)[known] == approx(wanted, abs=1e-6)
        assert np.array_equal(known, (exponential(0.0) <= wanted) & (exponential(8.0) >= wanted))
