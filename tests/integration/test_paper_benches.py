"""The papers' muscles on the bench: the engine follows each paper's law and operator."""

import re
from pathlib import Path

import numpy as np
import pytest

from pamsim.papers.alraouf2025 import figures as alraouf
from pamsim.papers.alraouf2025.loop import branch_data
from pamsim.papers.bench_experiments import bench, hanging_weight, hung, stretched
from pamsim.papers.nguyen2024 import figures as nguyen
from pamsim.papers.nguyen2024.geometry import element, muscle, omega
from pamsim.papers.nguyen2024.loop import complex_stiffness
from pamsim.papers.numerics import least_squares, rms
from pamsim.papers.sarosi import figures as sarosi
from pamsim.papers.vandamme2008 import figures as vandamme
from pamsim.papers.vandamme2008.shape import value
from pamsim.physics.force_laws.pleated import SLENDERNESS_6
from pamsim.physics.force_laws.published import PUBLISHED
from pamsim.recordings.printed import BRANCHES

PAPERS = Path(__file__).parents[2] / "docs" / "papers.md"


@pytest.fixture(scope="module")
def curves():
    rooms = {"sarosi": sarosi, "alraouf2025": alraouf, "nguyen2024": nguyen}
    return {name: room.bench_curves() for name, room in {**rooms, "vandamme2008": vandamme}.items()}


def test_a_muscle_of_sarosi_follows_its_law_held_hung_and_moved_slowly(curves):
    own, rig = curves["sarosi"], bench("sarosi")
    for bar in (1.0, 6.0):
        law = [sarosi.force_by_law(bar * 1e5, k / 100.0) for k in own["held_percent"]]
        assert own["isometric"][f"{bar:g} bar"] == pytest.approx(law, abs=1e-6)
    assert own["isometric"]["1 bar"][-1] == 0.0  # it never pushes
    assert own["isometric_off_n"] < 1e-6
    for load in (0.0, 10.0):
        run = hung(rig, np.array([0.0, 0.01]), np.full(2, 4e5), load=load)
        weight = hanging_weight(rig, load)
        assert weight == pytest.approx(9.81 * (0.5 + load))
        by_law = sarosi.contraction_by_law(4e5, weight)
        assert run.contraction[-1] == pytest.approx(by_law, abs=1e-6)
        assert run.tension[-1] == pytest.approx(weight, rel=1e-4)
    for each in own["isotonic"].values():
        assert each["off_percent"] < 0.1
        assert np.ptp(each["contraction_percent"]) > 20.0


def fit_hung_muscle(weight):
    """Least squares on the means of Table 2 with a weight [N], and the RMS misfit [cm]."""
    pressure, _ = branch_data("up")
    wanted = np.concatenate([branch_data(branch)[1] for branch in BRANCHES])

    def lengths(*values):
        muscle = alraouf.HungMuscle(*values)
        return np.concatenate([muscle.length(b, pressure, weight) for b in BRANCHES])

    start, bounds = (0.7, 3e4, 1500.0, 40.0, 4.0), ((0.3, 0, 10, 0.2, 0), (0.9, 9e4, 1e4, 200, 50))
    fitted, _ = least_squares(lengths, wanted, start, bounds=bounds, x_scale=start, diff_step=1e-5)
    return alraouf.HungMuscle(*fitted.tolist()), rms(lengths(*fitted) - wanted)


def test_the_muscle_of_alraouf_is_the_fit_to_table_2_and_its_loop_the_force_balance(curves):
    rig, own = bench("alraouf2025"), curves["alraouf2025"]
    weight = hanging_weight(rig, 0.0)
    fitted, misfit = fit_hung_muscle(weight)
    assert misfit < 0.15
    assert vars(alraouf.hung_muscle(rig)) == pytest.approx(vars(fitted), rel=1e-3)
    highest = rig.muscles["muscle"].hysteresis.high_contraction
    assert highest == pytest.approx(fitted.highest(weight), rel=1e-4)
    up, down = own["up"], own["down"]
    assert max(up["balance_off_cm"], down["balance_off_cm"]) < 0.01
    # The loop lies the right way round: shorter while the pressure falls.
    assert (up["length_cm"] - down["length_cm"])[50:-50].min() > 0.0
    assert up["length_cm"][-1] == down["length_cm"][-1]


def test_what_is_left_shrinks_with_its_cause(curves):
    """The causes that docs/papers.md names: friction of the guide, and speed."""
    smooth = bench("sarosi").with_parameters({"joint.rod.damping": 2.0})
    left = sarosi.isotonic(smooth, 0.0)["off_percent"]
    assert left < 0.01 < 0.2 * curves["sarosi"]["isotonic"]["0 kg"]["off_percent"]
    slow = alraouf.bench_curves(stroke=40.0)["up"]["balance_off_cm"]
    assert slow < 0.25 * curves["alraouf2025"]["up"]["balance_off_cm"]


def test_the_muscle_of_nguyen_is_isothermal_when_slow_and_its_cycle_that_of_the_element(curves):
    own, rig = curves["nguyen2024"]["stroke"], bench("nguyen2024")
    assert own["pressure_off_bar"] < 1e-6
    assert own["force_off_n"] < 1e-3
    assert own["length_mm"][[0, -1]] == pytest.approx([240.0, 300.0])
    for frequency in (0.05, 5.0):
        found = nguyen.cycle(rig, frequency)
        exact = complex_stiffness(omega(frequency), *element())
        assert found["area"] == pytest.approx(np.pi * 0.002**2 * exact.imag, rel=2e-3)
        assert abs(found["stiffness"]) == pytest.approx(abs(exact), rel=2e-4)


def test_tensile_loops_of_van_damme_are_the_operator_at_any_speed(curves):
    own, rig = curves["vandamme2008"], bench("vandamme2008")
    assert own["off_percent"] < 0.005  # the line through the major loop, on 80 levels
    assert own["pressure_spread_percent"] < 1e-6
    time = np.linspace(0.0, 0.8, 81)
    path = 0.2 + 0.13 * np.sin(5.0 * np.pi * time)
    fast = stretched(rig, time, path, 1.5e5).tension
    slow = stretched(rig, 5.0 * time, path, 1.5e5, timestep=2.5e-3).tension
    assert slow == pytest.approx(fast, rel=1e-9)


def test_benches_hold_the_published_numbers():
    muscles = {name: bench(name).muscles["muscle"] for name in ("sarosi", "vandamme2008")}
    assert vars(muscles["sarosi"].force) == pytest.approx(vars(PUBLISHED["DMSP-20-200"]))
    pleated, found = muscles["vandamme2008"].force, muscles["vandamme2008"].hysteresis
    assert pleated == SLENDERNESS_6
    printed = [value(name) for name in ("delta_40", "weight_c", "weight_d")]
    assert [found.force_share, found.c, found.d] == printed
    assert found.high_contraction == pytest.approx(0.01 * value("max_contraction"))
    maxwell = bench("nguyen2024").muscles["muscle"]
    found, (order, time_constant, stiffness) = maxwell.hysteresis, element()
    assert maxwell.braid == muscle()
    assert (found.order, found.time_constant) == (order, time_constant)
    assert found.force / found.span / maxwell.braid.nominal_length == pytest.approx(stiffness)


def test_documented_numbers_are_those_of_the_engine(curves):
    one, two, three, four = (
        curves[name] for name in ("sarosi", "alraouf2025", "nguyen2024", "vandamme2008")
    )
    end, rms, width = one["end_percent"], one["map_rms_n"], two["width_cm"]
    stroke, area, narrow, loops = (
        three["stroke"], three["area_mj"], three["width_mm"], four["loops"]
    )  # fmt: skip
    rows = [
        ("25 to 27", f"{end['law_free']:.2f}", f"{end['engine']:.2f}"),
        ("-", f"{sarosi.force_by_law(6e5, 0.0):.1f}", f"{one['isometric']['6 bar'][0]:.1f}"),
        ("-", f"{rms['law']:.1f}", f"{rms['engine']:.1f}"),
        ("0.174", f"{two['up']['printed_rmse_cm']:.3f}", f"{two['up']['rmse_cm']:.3f}"),
        ("0.172", f"{two['down']['printed_rmse_cm']:.3f}", f"{two['down']['rmse_cm']:.3f}"),
        tuple(f"{width[of]:.3f}" for of in ("table", "equations", "engine")),
    ]
    for law, engine, digits in (
        *((stroke[k]["law"][-1], stroke[k]["engine"][-1], 2) for k in ("pressure_bar", "force_n")),
        *((area["law"][i], area["engine"][i], 3) for i in (0, -1)),
        *((narrow[f][1], narrow[f][0], 2) for f in ("3.5 Hz", "8.5 Hz")),
        *((*(loops[n]["width_percent"][of] for of in ("law", "engine")), 2) for n in ("40", "25")),
    ):
        rows.append(("-", f"{law:.{digits}f}", f"{engine:.{digits}f}"))
    section = PAPERS.read_text(encoding="utf-8").partition("## On the bench")[2]
    table = re.findall(r"^\|.*?\|.*?\|([^|]*)\|([^|]*)\|([^|]*)\|$", section, re.MULTILINE)
    assert [tuple(map(str.strip, cells)) for cells in table[2:]] == rows
    isotonic = max(each["off_percent"] for each in one["isotonic"].values())
    balance = max(two[branch]["balance_off_cm"] for branch in ("up", "down"))
    equation = " and ".join(f"{two[branch]['equation_rmse_cm']:.3f}" for branch in ("up", "down"))
    for number in (
        f"{isotonic:.2f} %",
        f"{10.0 * balance:.2f} mm",
        f"{equation} cm",
        f"{three['area_off_percent']:.2f} %",
        f"{three['stiffness_off_percent']:.2f} %",
        f"{four['off_percent']:.3f} percentage points",
    ):
        assert number in " ".join(section.split()), number
