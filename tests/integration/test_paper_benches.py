"""The papers' muscles on the bench: the engine follows each paper's law and operator."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from pamsim.papers.alraouf2025 import figures as alraouf
from pamsim.papers.bench_experiments import bench, hanging_weight, hung, stretched
from pamsim.papers.nguyen2024 import figures as nguyen
from pamsim.papers.nguyen2024.fractional_reference import complex_stiffness
from pamsim.papers.nguyen2024.geometry import element, muscle, omega
from pamsim.papers.sarosi import figures as sarosi
from pamsim.papers.vandamme2008 import figures as vandamme
from pamsim.papers.vandamme2008.shape import value
from pamsim.physics.force_laws.pleated import SLENDERNESS_6
from pamsim.physics.force_laws.published import PUBLISHED

PAPERS = Path(__file__).parents[2] / "docs" / "papers.md"


@pytest.fixture(scope="module")
def curves():
    rooms = {"sarosi": sarosi, "alraouf2025": alraouf, "nguyen2024": nguyen}
    return {name: room.bench_curves() for name, room in {**rooms, "vandamme2008": vandamme}.items()}


def test_held_muscle_pulls_as_the_law_says_and_never_pushes(curves):
    own = curves["sarosi"]
    for bar in (1.0, 6.0):
        law = [sarosi.force_by_law(bar * 1e5, k / 100.0) for k in own["held_percent"]]
        assert own["isometric"][f"{bar:g} bar"] == pytest.approx(law, abs=1e-6)
    assert own["isometric"]["1 bar"][-1] == 0.0
    assert own["isometric_off_n"] < 1e-6


@pytest.mark.parametrize("load", [0.0, 10.0])
def test_hung_muscle_ends_where_the_law_carries_the_weight(load):
    rig = bench("sarosi")
    run = hung(rig, np.array([0.0, 0.01]), np.full(2, 4e5), load=load)
    weight = hanging_weight(rig, load)
    assert weight == pytest.approx(9.81 * (0.5 + load))
    assert run.contraction[-1] == pytest.approx(sarosi.contraction_by_law(4e5, weight), abs=1e-6)
    assert run.tension[-1] == pytest.approx(weight, rel=1e-4)


def test_slow_pressure_moves_a_weight_along_the_inverse_law(curves):
    for each in curves["sarosi"]["isotonic"].values():
        assert each["off_percent"] < 0.1
        assert np.ptp(each["contraction_percent"]) > 20.0


def test_hung_muscle_of_alraouf_is_the_fit_to_table_2():
    rig = bench("alraouf2025")
    fitted, rms = alraouf.fit_hung_muscle(hanging_weight(rig, 0.0))
    stated = alraouf.hung_muscle(rig)
    assert vars(stated) == pytest.approx(vars(fitted), rel=1e-3)
    hysteresis = rig.muscles["muscle"].hysteresis
    assert hysteresis.high_contraction == pytest.approx(
        fitted.highest(hanging_weight(rig, 0.0)), rel=1e-4
    )
    assert rms < 0.15


def test_pressure_loop_is_force_balance_with_the_operator(curves):
    own = curves["alraouf2025"]
    for branch in ("up", "down"):
        assert own[branch]["balance_off_cm"] < 0.01
    # The loop lies the right way round: shorter while the pressure falls.
    gap = own["up"]["length_cm"] - own["down"]["length_cm"]
    assert gap[50:-50].min() > 0.0
    assert own["up"]["length_cm"][-1] == own["down"]["length_cm"][-1]


def test_what_is_left_shrinks_with_its_cause(curves):
    """The causes that docs/papers.md names: friction of the guide, and speed."""
    smooth = bench("sarosi").with_parameters({"joint.rod.damping": 2.0})
    left = sarosi.isotonic(smooth, 0.0)["off_percent"]
    assert left < 0.01 < 0.2 * curves["sarosi"]["isotonic"]["0 kg"]["off_percent"]
    slow = alraouf.bench_curves(stroke=40.0)["up"]["balance_off_cm"]
    assert slow < 0.25 * curves["alraouf2025"]["up"]["balance_off_cm"]


def test_slow_stroke_on_shut_in_air_is_isothermal(curves):
    own = curves["nguyen2024"]["stroke"]
    assert own["pressure_off_bar"] < 1e-6
    assert own["force_off_n"] < 1e-3
    assert own["length_mm"][[0, -1]] == pytest.approx([240.0, 300.0])


def test_area_and_slope_of_a_cycle_are_those_of_the_element():
    rig = bench("nguyen2024")
    for frequency in (0.05, 5.0):
        found = nguyen.cycle(rig, frequency)
        exact = complex_stiffness(omega(frequency), *element())
        assert found["area"] == pytest.approx(np.pi * 0.002**2 * exact.imag, rel=2e-3)
        assert abs(found["stiffness"]) == pytest.approx(abs(exact), rel=2e-4)


def test_tensile_loops_are_the_operator_relay_by_relay(curves):
    own = curves["vandamme2008"]
    assert own["off_percent"] < 0.005  # the line through the major loop, on 80 levels
    assert own["pressure_spread_percent"] < 1e-6


def test_tensile_loop_does_not_depend_on_its_speed():
    rig = bench("vandamme2008")
    time = np.linspace(0.0, 0.8, 81)
    path = 0.2 + 0.13 * np.sin(5.0 * np.pi * time)
    fast = stretched(rig, time, path, 1.5e5).tension
    slow = stretched(rig, 5.0 * time, path, 1.5e5, timestep=2.5e-3).tension
    assert slow == pytest.approx(fast, rel=1e-9)


def test_benches_hold_the_published_numbers():
    assert vars(bench("sarosi").muscles["muscle"].force) == pytest.approx(
        vars(PUBLISHED["DMSP-20-200"])
    )
    pleated = bench("vandamme2008").muscles["muscle"]
    assert pleated.force == SLENDERNESS_6
    found = pleated.hysteresis
    assert (found.force_share, found.c, found.d) == tuple(
        value(name) for name in ("delta_40", "weight_c", "weight_d")
    )
    assert found.high_contraction == pytest.approx(0.01 * value("max_contraction"))
    maxwell = bench("nguyen2024").muscles["muscle"]
    assert maxwell.braid == muscle()
    order, time_constant, stiffness = element()
    found = maxwell.hysteresis
    assert (found.order, found.time_constant) == (order, time_constant)
    assert found.force / found.span / maxwell.braid.nominal_length == pytest.approx(stiffness)


def test_documented_numbers_are_those_of_the_engine(curves):
    one, two, three, four = (
        curves[name] for name in ("sarosi", "alraouf2025", "nguyen2024", "vandamme2008")
    )
    end, width, stroke = one["end_percent"], two["width_cm"], three["stroke"]
    area, narrow, loops = three["area_mj"], three["width_mm"], four["loops"]
    rows = [
        f"| 25 to 27 | {end['law_free']:.2f} | {end['engine']:.2f} |",
        f"| - | {sarosi.force_by_law(6e5, 0.0):.1f} | {one['isometric']['6 bar'][0]:.1f} |",
        f"| - | {one['map_rms_n']['law']:.1f} | {one['map_rms_n']['engine']:.1f} |",
        f"| 0.174 | {two['up']['printed_rmse_cm']:.3f} | {two['up']['rmse_cm']:.3f} |",
        f"| 0.172 | {two['down']['printed_rmse_cm']:.3f} | {two['down']['rmse_cm']:.3f} |",
        f"| {width['table']:.3f} | {width['equations']:.3f} | {width['engine']:.3f} |",
        *(
            f"| - | {stroke[key]['law'][-1]:.2f} | {stroke[key]['engine'][-1]:.2f} |"
            for key in ("pressure_bar", "force_n")
        ),
        *(f"| - | {area['law'][i]:.3f} | {area['engine'][i]:.3f} |" for i in (0, -1)),
        *(
            f"| - | {law:.2f} | {engine:.2f} |"
            for engine, law in (narrow["3.5 Hz"], narrow["8.5 Hz"])
        ),
        *(
            f"| - | {loops[n]['width_percent']['law']:.2f}"
            f" | {loops[n]['width_percent']['engine']:.2f} |"
            for n in ("40", "25")
        ),
    ]
    text = PAPERS.read_text(encoding="utf-8")
    section = text[text.index("## On the bench") :]
    assert re.findall(r"^\|.*?\|.*?(\|[^|]*\|[^|]*\|[^|]*\|)$", section, re.MULTILINE)[2:] == rows
    isotonic = max(each["off_percent"] for each in one["isotonic"].values())
    balance = max(two[branch]["balance_off_cm"] for branch in ("up", "down"))
    for number in (
        f"{isotonic:.2f} %",
        f"{10.0 * balance:.2f} mm",
        f"{two['up']['equation_rmse_cm']:.3f} and {two['down']['equation_rmse_cm']:.3f} cm",
        f"{three['area_off_percent']:.2f} %",
        f"{three['stiffness_off_percent']:.2f} %",
        f"{four['off_percent']:.3f} percentage points",
    ):
        assert number in " ".join(section.split()), number
