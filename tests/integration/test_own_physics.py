"""Laws, operators and effects from outside the package: the documentation's example, and faults."""

import dataclasses
import json
import math
import re
import shutil
import subprocess
import sys
import uuid
from importlib.metadata import EntryPoint
from pathlib import Path

import mujoco
import numpy as np
import pytest

import pamsim
from pamsim.comparison.effects_on_rig import candidates, forms
from pamsim.core import catalog
from pamsim.core.errors import EngineError, InputError
from pamsim.engine.rig import _compiled
from pamsim.physics.chosen_law import law_force, law_functions
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.force_laws.exponential import SixParameter, six_parameter_force
from pamsim.physics.record import pack, parameters, slot, unpack
from pamsim.recordings.rig_writer import write_rig
from tests.both_backends import both_backends
from tests.integration.page_blocks import BLOCK, DOCS, run_line
from tests.unit.physics.flat import chamber_volume

LIFT = pamsim.pressure_step((2e5,), (3e5,), duration=0.2, load=5.0, sample_rate=100.0)
LIFT = dataclasses.replace(LIFT, settle=0.1)  # Python is slow
ONE_MODEL = {"order": 1, "dead_time": "none", "arx": (1, 1, 1), "oe": (1, 1, 1), "local": False}

BACKENDS = ("compiled", "python")

pytestmark = pytest.mark.usefixtures("catalogs_as_before")


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Folder in which every block of the page ran."""
    folder = tmp_path_factory.mktemp("own")
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.chdir(folder)
        for language, block in BLOCK.findall((DOCS / "own_physics.md").read_text("utf-8")):
            match language:
                case "sh":
                    for line in block.splitlines():
                        run_line(line.replace("--duration 3", "--duration 1.5"), monkeypatch)
                case "python":
                    Path(re.match(r"# (\S+)", block)[1]).write_text(block, encoding="utf-8")
                case "toml" if block.startswith("[muscle.force]"):
                    path = Path("my_bench/params.toml")
                    old = path.read_text(encoding="utf-8")
                    new, count = re.subn(r"\[muscle\.force\]\n(.+\n)+", block, old)
                    assert count == 1
                    path.write_text(new, encoding="utf-8")
                case "toml":
                    assert "entry-points" in block
                case _:
                    pytest.fail(f"a block of {language}, which nothing runs")
    return folder


@pytest.fixture(scope="module")
def rig(bench):
    return pamsim.load_rig(bench / "my_bench")


@pytest.fixture
def edited(bench, tmp_path):
    """Makes a copy of the rig whose file of effects is another."""

    def copy(change):
        folder = shutil.copytree(bench / "my_bench", tmp_path / uuid.uuid4().hex / "my_bench")
        file = folder / "effects.py"
        file.write_text(change(file.read_text(encoding="utf-8")), encoding="utf-8")
        return folder

    return copy


def test_an_effect_of_ones_own_is_hidden_named_and_sized(bench):
    found = json.loads((bench / "found" / "diagnosis.json").read_text(encoding="utf-8"))
    (effect,) = found["effects"]
    assert (found["verdict"], effect["name"], effect["family"]) == (
        "named", "seam_stiffness", "seam"
    )  # fmt: skip
    low, high = effect["sizes"]["force.seam"]["interval95_si"]
    assert low <= 120.0 <= high < low + 30.0
    repaired = pamsim.load_rig(bench / "found" / "rig")
    assert low <= repaired.muscles["lifter"].force.seam <= high


def test_compiled_and_python_agree(rig):
    plain = rig.with_parameters({"force.seam": 60.0})
    loop = {"hysteresis.one_block.slip": 0.006, "hysteresis.force_per_pressure": 2e-4}
    without = pamsim.simulate(plain, LIFT).completed()
    for one, moved in ((plain, 0.0), (plain.with_parameters(loop), 1e-4)):
        run = both_backends(one, LIFT)
        assert np.ptp(run.positions) > 1e-3
        assert np.abs(run.positions - without.positions).max() >= moved


def with_law(rig, name, force_function):
    """The rig with the numbers of its force law, and a function from outside as the law."""

    @dataclasses.dataclass(frozen=True, kw_only=True)
    class Copied(SixParameter):
        law = name

    law = pamsim.ForceLaw(
        title="Copy",
        equation="as six_parameter",
        source="this test",
        group=Copied,
        force_function=force_function,
        pressure_range=(0.0, 6e5),
    )
    FORCE_LAWS.add(law, "this test")
    sections = {**rig.file.muscle, "force": {**rig.file.muscle["force"], "law": name}}
    return _compiled(dataclasses.replace(rig.file, muscle=sections))


def copied_force(pressure, contraction, a, b, c, d, e, f):
    return six_parameter_force(pressure, contraction, a, b, c, d, e, f)


def noted(calls):
    """A function with a memory of its own."""

    def force(pressure, contraction, *coefficients):
        calls["most"] = max(calls.get("most", 0.0), pressure)
        return six_parameter_force(pressure, contraction, *coefficients)

    return force


def scaled(factor):
    def force(pressure, contraction, *coefficients):
        return factor * six_parameter_force(pressure, contraction, *coefficients)

    return force


def test_anything_that_can_be_called_is_a_law_and_a_copy_does_as_the_original():
    theirs, calls = pamsim.load_rig("mas20_arm"), {}
    step = pamsim.pressure_step((3e5, 3e5), (3e5, 2.5e5), duration=0.1, sample_rate=100.0)
    step = dataclasses.replace(step, settle=0.02)
    one = pamsim.simulate(theirs, step, timestep=1e-3).completed()
    for name, law, backend in (
        ("copied", copied_force, "compiled"),
        ("closure", noted(calls), "python"),
    ):
        ours = with_law(theirs, name, law)
        assert unpack(ours.model.actuator_user[0]).force.law == name
        other = pamsim.simulate(ours, step, timestep=1e-3, backend=backend).completed()
        assert np.ptp(one.angle) > 1e-8
        np.testing.assert_allclose(other.angle, one.angle, atol=1e-9, err_msg=name)
    with pytest.raises(InputError, match=r"'closure' .*cannot be compiled.*='python'"):
        pamsim.simulate(ours, step)
    assert 3e5 < calls["most"] < 3.2e5


def test_two_functions_of_one_text_are_two_laws():
    rig = pamsim.load_rig("mas20_arm")
    one, other = (
        law_functions(float(each.model.actuator_user[0, slot("force.law")]))[law_force](
            parameters(each.muscles["muscle_1"]), 3e5, 0.05
        )
        for each in (with_law(rig, "scaled", scaled(factor)) for factor in (1.0, 0.5))
    )
    assert other == 0.5 * one


def sorts(pressure, *_):
    return sorted({pressure: "p"})[0]


def rounds(pressure):
    return math.floor(pressure, 2)


def calls(pressure, *_):
    return rounds(pressure)


def says(pressure, *_):
    return "none" if pressure > 0.0 else pressure


def imports(pressure, *_):
    import statistics

    return statistics.mean((pressure, pressure))


def opens(pressure):
    with open("area.txt") as file:
        return pressure * float(file.read())


def reads(pressure, *_):
    return opens(pressure)


def misnames(pressure):
    return pressure * absent  # noqa: F821


def names(pressure, *_):
    return misnames(pressure)


@pytest.mark.parametrize(
    ("law", "text", "reason"),
    [
        (sorts, 'return sorted({pressure: "p"})[0]', "no compiled form of sorted("),
        (calls, "return math.floor(pressure, 2)", "no compiled form of floor("),
        (says, 'return "none" if pressure > 0.0 else pressure', "Cannot unify"),
        (imports, "import statistics", "Use of unsupported opcode (IMPORT_NAME)"),
        # The compiler gives no line of these two: that of their function takes its place.
        (reads, "def opens(pressure):", "The 'with "),
        (names, "def misnames(pressure):", "name 'absent' is not defined;"),
    ],
)
def test_a_law_that_cannot_be_compiled_is_named_with_the_line_and_the_innermost_reason(
    law, text, reason
):
    name, file = f"own_{law.__name__}", Path(__file__)
    rig = with_law(pamsim.load_rig("mas20_arm"), name, law)
    with pytest.raises(InputError) as error, pamsim.live(rig.model):
        pytest.fail("it was compiled")
    (line,) = (n for n, one in enumerate(file.read_text().splitlines(), 1) if one.strip() == text)
    refusal = f"the law '{name}' cannot be compiled: {file}, line {line}, `{text}`: {reason}"
    assert str(error.value).startswith(refusal)
    assert "\n" not in str(error.value)


def test_a_volume_that_is_not_stated_does_the_force_s_work(rig):
    force, braid = rig.muscles["lifter"].force, rig.muscles["lifter"].braid
    law = FORCE_LAWS["flat_muscle"]
    numbers = [getattr(force, field.name) for field in dataclasses.fields(force)]
    for kappa in (0.05, 0.2):
        ends = [law.volume(2e5, kappa + step, numbers, braid) for step in (-1e-4, 1e-4)]
        low, high = (law.force(p, kappa, numbers, braid) for p in (1e5, 3e5))
        swept = (ends[1] - ends[0]) / (2e-4 * braid.nominal_length)
        assert swept == pytest.approx((high - low) / 2e5)
    row = pack(rig.muscles["lifter"]).tolist()
    row[slot("braid.extensibility")] = 1e-8  # the work is integrated, too
    assert math.isfinite(chamber_volume(row, [0.0] * 20, -0.03, 2e5))


def test_code_runs_only_if_its_rig_is_named(bench, monkeypatch):
    """A recording or a study comes from anywhere, with the rig that it names."""
    monkeypatch.chdir(bench)

    def run_unasked(path, *_):
        raise AssertionError(path)

    monkeypatch.setattr("pamsim.recordings.rig_file._own_physics", run_unasked)
    for job in (pamsim.check, pamsim.diagnose, lambda data: pamsim.calibrate([data])):
        with pytest.raises(InputError, match=r"effects\.py is code, which runs only if you name"):
            job(bench / "data")
    study = bench / "study.toml"
    for name in ('rig = "my_bench"', "[vary.rig]\nvalues = ['my_bench']"):
        study.write_text(
            f'schema = "pamsim-sweep/1"\n{name}\n[experiment]\n[vary.load]\nvalues = [0]\n'
        )
        with pytest.raises(InputError, match=r"trust the rigs of the study: give `trust_rig`"):
            pamsim.sweep(study, out=bench / "swept")
        with pytest.raises(AssertionError, match=r"effects\.py"):
            pamsim.sweep(study, out=bench / "swept", trust_rig=True)
    found = pamsim.identify(bench / "data", trials=["multisine_1"], **ONE_MODEL)
    assert found.shown.fit.estimates  # that needs no rig


def test_another_law_never_takes_the_place_of_a_saved_one(rig, edited):
    other = pamsim.load_rig(edited(lambda text: text.replace("-8.0", "-9.0")))
    row, law = pack(rig.muscles["lifter"]), slot("force.law")
    assert pack(other.muscles["lifter"])[law] != row[law]
    seam = {"force.seam": 200.0}
    old, new = (pamsim.simulate(one.with_parameters(seam), LIFT) for one in (rig, other))
    assert np.abs(old.positions - new.positions).max() > 1e-5
    row[law] += 2.0
    with pytest.raises(EngineError, match="install the package"):
        unpack(row)
    model = rig.model_for()
    data = mujoco.MjData(model)
    pamsim.reset(model, data, [2e5])
    model.actuator_user[0, law] += 2.0
    mujoco.mj_forward(model, data)
    assert np.isnan(data.actuator_force[0])


def test_numbers_that_a_law_reads_from_a_file_beside_it_are_those_of_the_file_as_it_is(edited):
    folder = edited(
        lambda text: text.replace("-8.0", "WEIGHTS[0]").replace(
            "import pamsim\n",
            "import numpy\nimport pamsim\n"
            "WEIGHTS = numpy.loadtxt(__file__.replace('effects.py', 'weights.txt'), ndmin=1)\n",
            1,
        )
    )
    ends = {}
    for weight in ("-8.0", "-9.0"):
        (folder / "weights.txt").write_text(f"{weight}\n")
        rig = pamsim.load_rig(folder).with_parameters({"force.seam": 200.0})
        ends[weight] = [pamsim.simulate(rig, LIFT, backend=b).positions for b in BACKENDS]
        np.testing.assert_allclose(*ends[weight], rtol=0.0, atol=1e-12)
    assert np.abs(ends["-8.0"][0] - ends["-9.0"][0]).max() > 1e-5


def test_a_written_rig_keeps_its_laws_and_its_effects_are_tried_on_it_alone(rig, tmp_path):
    write_rig(rig.file, tmp_path / "new", {})
    again = pamsim.load_rig(tmp_path / "new")
    np.testing.assert_array_equal(again.model.actuator_user, rig.model.actuator_user)
    assert [one.name for one in again.file.own.effects] == ["seam_stiffness", "muscle_hysteresis"]
    own, others = (
        {one.label for one in candidates(each)[0]}
        for each in (again, pamsim.load_rig("muscle_bench"))
    )
    new = {"seam_stiffness", "muscle_hysteresis:one_block"}
    assert new <= own
    assert not new & others


RUN = """
import sys, pamsim
step = pamsim.pressure_step((2e5,), (3e5,), duration=0.05, load=5.0, sample_rate=100.0)
print(pamsim.simulate(pamsim.load_rig(sys.argv[1]), step).positions[-1])
"""


def test_compiled_code_of_ones_own_law_is_found_by_a_process_with_a_copy_of_the_rig(edited):
    found, fresh = [], f"    # {uuid.uuid4()}: nothing of it is compiled yet\n    return "
    for _ in range(2):
        folder = edited(lambda text: text.replace("    return ", fresh))
        args = [sys.executable, "-c", RUN, folder]
        found.append(subprocess.run(args, capture_output=True, text=True, check=True).stdout)
        shutil.rmtree(folder)
    assert found[0] == found[1] != ""


def test_a_law_is_fitted_to_a_force_map(bench, tmp_path, monkeypatch, capsys):
    lines = ["p_kpa,contraction,force_n"]
    for p in (100.0, 200.0, 300.0):
        for kappa in np.linspace(0.0, 0.2, 7):
            force = 1e3 * p * 8e-4 * (1.0 - kappa / 0.32) + 50.0 * math.expm1(-8.0 * kappa)
            lines.append(f"{p},{kappa:.6f},{force:.6f}")
    (tmp_path / "map.csv").write_text("\n".join(lines), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    line = f"pamsim fit map.csv --rig {bench / 'my_bench'} --model flat_muscle --nominal-length 300"
    run_line(f"{line} --hold scale=1 --json fit.json", monkeypatch)
    (fit,) = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))["fits"]
    values = {c["name"]: c["value"] for c in fit["coefficients"]}
    assert values["area"] == pytest.approx(8e-4, rel=1e-4)
    assert values["stroke"] == pytest.approx(0.32, rel=1e-4)
    assert values["seam"] == pytest.approx(50.0, rel=1e-3)


def test_a_fault_in_the_file_is_one_line(edited):
    pleated = "import pamsim.physics.force_laws.catalog as c\nLAWS = [c.FORCE_LAWS['pleated']]"
    for text, words in (
        ("LAWS = [", "line 1: SyntaxError"),
        ("import pamsim\nx = 1 / 0", "line 2: ZeroDivisionError"),
        ("import sys\nsys.exit(3)", "line 2: SystemExit: 3"),
        (
            "class E(Exception):\n    def __str__(self): raise self\nraise E",
            "line 3: E: <exception",
        ),
        ("LAW = []", "has neither a list LAWS nor a list EFFECTS"),
        ("EFFECTS = [3]", "EFFECTS holds 3"),
        ("LAWS = 3", "LAWS must be a list of ForceLaw and Operator"),
        (pleated, "'pleated' of its own"),
    ):
        with pytest.raises(InputError, match=words) as error:
            pamsim.load_rig(edited(lambda _, text=text: text))
        assert "effects.py" in str(error.value)
        assert "\n" not in str(error.value)


def test_a_law_that_fails_where_a_run_starts_is_named_with_its_line(edited):
    for mistake, reason in (("math.log(-area)", "math domain error"), ("1 / 0.0", "division")):
        folder = edited(
            lambda text, m=mistake: text.replace("return pressure", f"return {m} + pressure")
        )
        rig, file = pamsim.load_rig(folder), re.escape(str(folder / "effects.py"))
        with pytest.raises(InputError, match=rf"'lifter' fails .*{file}, line \d+, `.*{reason}"):
            pamsim.simulate(rig, LIFT)


def test_a_force_takes_the_numbers_of_its_law_in_their_order(edited):
    """By names in another order, its volume would be that of another law."""
    arguments = "pressure, contraction, area, stroke, seam"
    for wrong in ("pressure, contraction, stroke, area, seam", "pressure, contraction, area"):
        folder = edited(lambda text, w=wrong: text.replace(f"force({arguments})", f"force({w})"))
        with pytest.raises(InputError, match=f"takes {wrong}; let it take {arguments}, all in"):
            pamsim.load_rig(folder)


def test_an_installed_package_offers_laws_and_effects(rig, monkeypatch):
    effect = dataclasses.replace(rig.file.own.effects[0], name="mine")
    law = dataclasses.replace(FORCE_LAWS["flat_muscle"])
    found = {"pamsim.laws": [law], "pamsim.effects": [effect]}

    def entry_points(group):
        return [EntryPoint(name="x", value=f"{__name__}:{group}", group=group)]

    monkeypatch.setattr(catalog.importlib.metadata, "entry_points", entry_points)
    monkeypatch.setattr(EntryPoint, "load", lambda self: found[self.group])
    catalog.installed.cache_clear()
    assert list(catalog.Catalog(pamsim.ForceLaw, (), slot="force.law")) == ["flat_muscle"]
    assert forms(None)["mine"] == (effect,)
    monkeypatch.setattr(EntryPoint, "load", lambda self: 1 / 0)
    catalog.installed.cache_clear()
    with pytest.raises(InputError, match="cannot be loaded: division by zero"):
        forms(None)
    catalog.installed.cache_clear()
