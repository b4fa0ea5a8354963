"""Freeze the numbers of single runs, so that a change of the code can be seen not to change them.

    python scripts/freeze_runs.py OUT.json
    python scripts/freeze_runs.py --compare BEFORE.json AFTER.json [--rtol 1e-9]

`freeze_results.py` freezes what the commands answer. Here every shipped rig runs under every drive
and with every effect, each force law and hysteresis operator on the bench, and environments and
Warp run. Only public names of pamsim are used: the modules may move. Which code runs is that of an
absolute PYTHONPATH. That a run is refused is compared too, the words of the refusal are not.
"""

from __future__ import annotations

import importlib.util
import json
import math
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import click
import gymnasium
import numpy as np
from tqdm import tqdm

import pamsim
import pamsim.envs  # registers the environments

TIMES = (0.0, 0.1, 0.2, 0.3)  # of commands [s]
EFFECT_TIMESTEP = 2.5e-4  # s, short enough for dry friction on every rig
ROUNDING = 1e-9  # size in SI that a column of less is given: what is left of zero is not compared

Columns = dict[str, Any]


class Setting(NamedTuple):
    """Pressures at rest and after a step [Pa], load [kg], how joints are driven.

    Of a joint: kinds of drive by effort and by motion, largest effort, middle and swing [SI].
    """

    start: tuple[float, ...]
    end: tuple[float, ...]
    load: float
    joints: Mapping[str, tuple[str, str, float, float, float]]


ROD = {"rod": ("force", "length", 60.0, -0.005, 0.004)}
SHAFT = {"shaft": ("torque", "angle", 1.5, 0.0, 0.1)}
ELBOW = ("torque", "angle", 1.0, 0.1, 0.2)
ARM = {"shoulder": ELBOW, "elbow": ELBOW}
LEG = {"hip": ("torque", "angle", 0.3, 1.5, 0.1), "knee": ("torque", "angle", 0.2, 1.2, 0.1)}
RIGS = {
    "mas20_arm": Setting((3e5, 3e5), (3e5, 1e5), 1.2, SHAFT),
    "muscle_bench": Setting((3e5,), (1.8e5,), 20.0, ROD),
    "muscle_bench/alraouf2025": Setting((3e5,), (1.8e5,), 5.0, ROD),
    "muscle_bench/nguyen2024": Setting((3e5,), (1.8e5,), 20.0, ROD),
    "muscle_bench/sarosi": Setting((3e5,), (1.8e5,), 20.0, ROD),
    "muscle_bench/vandamme2008": Setting((1.5e5,), (2.5e5,), 20.0, ROD),
    "two_joint_arm": Setting((2.5e5,) * 4, (3.5e5, 1.5e5, 3e5, 2e5), 1.0, ARM),
    "equimus_leg": Setting((2e4, 2e4), (4e4, 1e4), 0.0, LEG),
}

# Parameters that switch an effect on, in SI; its name is the first of them.
EFFECTS = """
chamber.leak_conductance=2e-12; chamber.laminar_leak_conductance=1e-12; chamber.heat_rate=5
creep.stiffness=3e3 creep.relaxation_time=0.2 creep.stiffness_2=1e3
chain.compliance=2e-6 chain.relaxation_time=0.01; chain.backlash=5e-4
chain.ripple=3e-4 chain.ripple_phase=0.5; friction.tension_share=0.01
friction.stribeck_force=4 friction.stribeck_velocity=0.02; friction.coulomb_force=5
friction.breakaway_force=7 friction.coulomb_force=5
friction.bristle_time=0.002 friction.coulomb_force=5 friction.presliding=1e-4
valve.dead_zone=0.05 valve.dead_zone_asymmetry=0.3; valve.regulator_dead_band=3e3
valve.line_lag=0.02; valve.line_slew_time=0.05; valve.travel_time=0.02; valve.delay=0.004
valve.tube_resistance=1e8; valve.supply_resistance=2e8; valve.supply_square=1e12
valve.supply_volume=1e-4 valve.supply_resistance=2e8
braid.friction=1e-4; braid.extensibility=2e-8
threshold.pressure=1e4; end_shape.loss=0.3 end_shape.onset=0.02
parallel_hysteresis.force=5 parallel_hysteresis.force_per_pressure=1e-5
hysteresis.force=5 hysteresis.force_share=0.05 hysteresis.chord=2
hysteresis.maxwell_slip.force=10
"""

# Beside the laws of the shipped rigs; numbers without a unit have the unit 1.
LAWS = """
force ideal_mckibben
force corrected_mckibben a_eps=0.2 b_eps=-1.1 a_kappa=0.1 b_kappa=-0.9
force single_pressure_exponential a=300:N b=-30 d=-3000:N e=700:N
force invertible_exponential a=-4:N/bar b=292:N c=-33 e=-930:N/bar f=0:N g=294:N/bar h=-280:N
force elastic_energy working_pressure=100:kPa working_contraction=0.2
force pleated f0=0.11 f1=-0.4 f2=0.5 f3=-1.0 f4=0.0
force pleated_shape slenderness=6
force mooney_rivlin c1=-150:N c2=360:N active_share=0.95
hysteresis bouc_wen yield_contraction=0.005 sharpness=1.5
hysteresis maxwell_slip elements=6 full_slip=0.02 decay=0.8
hysteresis prandtl_ishlinskii elements=6 span=0.06 linear_share=0.3
hysteresis preisach levels=60 low_contraction=-0.06 high_contraction=0.3
hysteresis pleated_factor levels=60 low_contraction=-0.06 high_contraction=0.3
hysteresis arctangent turning_points=6 low_contraction=-0.06 high_contraction=0.3
hysteresis fractional_maxwell order=0.27 time_constant=0.3:s span=0.06
"""
WIDTH = "force=20:N force_per_pressure=4:N/bar force_share=0.05 chord=2"  # of every operator

ENVIRONMENTS: dict[str, dict[str, Any]] = {
    "pamsim/PamArmPressure-v0": {"task": "step", "angle_noise": 1e-3},
    "pamsim/PamArmValve-v0": {"task": "disturbance", "delay": 0.0035, "instruments": True},
    "pamsim/PamArmOnOff-v0": {"task": "stiffness", "randomize": True, "load": (0.0, 2.0)},
    "pamsim/Rig-v0": {"rig": "two_joint_arm", "task": "disturbance", "randomize": True},
}


def experiment(setting: Setting, drive: Any, columns: Any, **more: Any) -> Any:
    """An experiment with a column of values at `TIMES` per muscle and driven joint."""
    return pamsim.Experiment(
        drive=drive,
        command_time=np.array(TIMES),
        command_value=np.array(columns).T,
        start_pressure=np.array(setting.start),
        load=setting.load,
        **{"duration": 0.4, "sample_rate": 200.0, "settle": 1.0, **more},
    )


def pressures(setting: Setting) -> list[list[float]]:
    """Set points of each muscle."""
    pairs = zip(setting.start, setting.end, strict=True)
    return [[a, b, 0.5 * (a + b), 0.8 * a] for a, b in pairs]


def step(setting: Setting, **more: Any) -> Any:
    """The experiment of these set points."""
    return experiment(setting, "pressure_set", pressures(setting), **more)


def driven(setting: Setting, muscles: Sequence[str]) -> Iterator[tuple[str, Any]]:
    """Every drive that a rig takes: its name, and the experiment."""
    opening = np.outer([(-1.0) ** i for i in range(len(muscles))], [0.4, -0.6, 0.0, 0.2])
    columns = dict.fromkeys(("pressure_set", "measured"), pressures(setting))
    columns |= {"valve": opening, "pulse": opening, "sealed": 0.0 * opening}
    for air, values in columns.items():
        yield air, experiment(setting, air, values)
        for joint, (by_effort, by_motion, most, middle, swing) in setting.joints.items():
            for kind, centre, size in ((by_effort, 0.0, most), (by_motion, middle, swing)):
                column = [centre, centre + size, centre - size, centre + 0.2 * size]
                drive = {**dict.fromkeys(muscles, air), joint: kind}
                yield f"{air}, {joint} {kind}", experiment(setting, drive, [*values, column])


def effects() -> list[dict[str, float]]:
    """`EFFECTS` as dictionaries."""
    each = (one.split() for line in EFFECTS.split("\n") if line for one in line.split(";"))
    pairs = ((entry.split("=") for entry in one) for one in each)
    return [{name: float(value) for name, value in one} for one in pairs]


def columns_of(run: Any, prefix: str = "") -> Columns:
    """Signals of a recording, and its speeds."""
    speeds = zip(run.joints, run.velocities.T, strict=True)
    found = {**run.signals(), **{f"{joint}.velocity": speed for joint, speed in speeds}}
    return {f"{prefix}{name}": column for name, column in found.items()}


def simulated(rig: Any, what: Any, values: dict[str, float], **options: Any) -> Columns:
    """Signals of a rig with some parameters changed."""
    return columns_of(pamsim.simulate(rig.with_parameters(values), what, **options))


def with_all(rig: Any, what: Any) -> Columns:
    """Signals with every effect that the rig takes beside those before it."""
    taken: dict[str, float] = {}
    found: Columns = {}
    for effect in effects()[:-1]:  # the last is another operator
        try:
            found = simulated(rig, what, {**taken, **effect}, timestep=EFFECT_TIMESTEP)
        except pamsim.PamsimError:
            continue
        taken |= effect
    return found


def with_law(group: str, law: str, entries: Sequence[str]) -> Columns:
    """Signals of the bench with another law: moved by its weight, and over an imposed length."""
    source, setting = pamsim.load_rig("muscle_bench").file.folder, RIGS["muscle_bench"]
    section = f'[muscle.{group}]\nlaw = "{law}"\n'
    for name, value in (entry.split("=") for entry in entries):
        number, _, unit = value.partition(":")
        section += f'{name} = {{ value = {number}, unit = "{unit or 1}", source = "assumed" }}\n'
    parts = (source / "params.toml").read_text(encoding="utf-8").split("\n\n")
    kept = [part for part in parts if f"[muscle.{group}]\n" not in part]
    text = "\n\n".join([*kept, section])
    text = text.replace("length_at_zero = { value = 250", "length_at_zero = { value = 225")
    with tempfile.TemporaryDirectory() as folder:
        for path in source.glob("*.xml"):
            shutil.copy(path, folder)
        Path(folder, "params.toml").write_text(text, encoding="utf-8")
        rig = pamsim.load_rig(folder)
    imposed = [*pressures(setting), [0.0, -0.02, 0.005, -0.01]]
    moved = experiment(setting, {"muscle": "pressure_set", "rod": "length"}, imposed)
    found = columns_of(pamsim.simulate(rig, step(setting)), "free ")
    return {**found, **columns_of(pamsim.simulate(rig, moved), "moved ")}


def episode(make: Callable[[], Any]) -> Columns:
    """Observations and rewards of seeded random actions."""
    env = make()
    env.action_space.seed(3)
    observed, rewards = [env.reset(seed=7)[0]], []
    for _ in range(200):
        observation, reward, *_ = env.step(env.action_space.sample())
        observed.append(observation)
        rewards.append(reward)
    env.close()
    entries = np.moveaxis(np.array(observed), -1, 0)
    return {**{f"observation {i}": entry for i, entry in enumerate(entries)}, "reward": rewards}


def worlds() -> Columns:
    """Signals of two worlds on Warp's CPU."""
    rig = pamsim.load_rig("mas20_arm")
    brief = step(RIGS["mas20_arm"], duration=0.02, sample_rate=500.0)
    other = rig.with_parameters({"passive.stiffness": 12e3, "joint.shaft.damping": 1.0})
    one, two = pamsim.simulate_worlds([(rig, brief), (other, brief)], device="cpu", threads=1)
    return {**columns_of(one, "1 "), **columns_of(two, "2 ")}


def runs() -> Iterator[tuple[str, Callable[[], Columns]]]:
    """Every run: its name, and what gives its columns."""
    models = pamsim.load_rig("muscle_bench").file.folder.parent
    for name, setting in RIGS.items():
        rig = pamsim.load_rig(models / name)
        for drive, what in driven(setting, list(rig.muscles)):
            yield f"{name}: {drive}", partial(simulated, rig, what, {})
        brief = step(setting, duration=0.15, settle=0.1)
        idle = {"each_step": lambda model, data: None}  # runs without the compiled loop
        yield f"{name}: python", partial(simulated, rig, brief, {}, backend="python")
        yield f"{name}: interpreted", partial(simulated, rig, brief, {}, **idle)
        usual, short = step(setting), {"timestep": EFFECT_TIMESTEP}
        yield f"{name}: short steps", partial(simulated, rig, usual, {}, **short)
        dry = {f"joint.{joint}.frictionloss": 0.1 for joint in setting.joints}
        supply = {"valve.supply_volume": 1e-4, "valve.supply_resistance": 2e8}
        apart = {f"{next(iter(rig.muscles))}:valve.supply_line": 1.0, **supply}
        for effect in (*effects(), dry, apart):
            yield f"{name}: {next(iter(effect))}", partial(simulated, rig, usual, effect, **short)
        yield f"{name}: all effects", partial(with_all, rig, usual)
    for group, law, *entries in map(str.split, LAWS.strip().split("\n")):
        width = WIDTH.split() if group == "hysteresis" else []
        yield f"{group} {law}", partial(with_law, group, law, [*width, *entries])
    for env, options in ENVIRONMENTS.items():
        yield env, partial(episode, partial(gymnasium.make, env, **options))
        yield f"{env}, 4", partial(episode, partial(gymnasium.make_vec, env, 4, **options))
    if importlib.util.find_spec("warp"):
        yield "worlds", worlds


def frozen(run: Callable[[], Columns]) -> dict[str, Any]:
    """Number of values, last one, sum and sum of squares of each column; or why it is refused."""
    try:
        columns = run()
    except pamsim.PamsimError as error:
        return {"refused": str(error)}
    flat = {name: np.asarray(column, float).ravel().tolist() for name, column in columns.items()}
    return {
        name: [len(values), values[-1], math.fsum(values), math.fsum(v * v for v in values)]
        for name, values in flat.items()
    }


def difference(before: dict[str, Any], after: dict[str, Any]) -> tuple[float, str]:
    """Largest difference of two runs, relative to the size of its column; and the column."""
    if before.keys() != after.keys():
        return math.inf, "other columns, or refused once"
    worst = (0.0, "")
    for name in before.keys() - {"refused"}:
        (count, *old), (other, *new) = before[name], after[name]
        size = max(math.sqrt(old[-1] / count), ROUNDING)
        scales = (size, size * count, size * size * count)
        gaps = [abs(b - a) / scale for a, b, scale in zip(old, new, scales, strict=True)]
        same = count == other and not any(map(math.isnan, gaps))
        worst = max(worst, (max(gaps) if same else math.inf, name))
    return worst


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("out", type=click.Path(path_type=Path), required=False)
@click.option("--compare", nargs=2, type=click.Path(exists=True, path_type=Path))
@click.option("--rtol", type=float, default=1e-9, show_default=True)
def main(out: Path | None, compare: tuple[Path, Path] | None, rtol: float) -> None:
    """Freeze runs into OUT, or compare two such files; exit code 1 if they differ."""
    if compare:
        before, after = (json.loads(p.read_text(encoding="utf-8"))["runs"] for p in compare)
        names = sorted(before.keys() | after.keys())
        rows = [(*difference(before.get(name, {}), after.get(name, {})), name) for name in names]
        differing = sorted((row for row in rows if row[0] > rtol), reverse=True)
        for gap, where, name in differing:
            click.echo(f"{gap:8.1e}  {name}  ({where})")
        largest = max(gap for gap, _, _ in rows)
        click.echo(f"{len(differing)} of {len(rows)} runs differ; largest difference {largest:.2g}")
        sys.exit(bool(differing))
    if out is None:
        raise click.UsageError("give a file to write, or --compare BEFORE AFTER")
    began = time.perf_counter()
    table = {name: frozen(run) for name, run in tqdm(runs())}
    result = {"pamsim": str(pamsim.__file__), "runs": table}
    out.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    for name, run in table.items():
        if "refused" in run:
            click.echo(f"refused: {name}: {run['refused'][:120]}")
    click.echo(f"{pamsim.__file__}: {len(table)} runs, {time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
