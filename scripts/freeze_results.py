"""Freeze what the commands answer, so that a change of the code can be seen not to change numbers.

    python scripts/freeze_results.py data DIR
    python scripts/freeze_results.py run DIR OUT [--only NAME] [--python PYTHON]
    python scripts/freeze_results.py compare BEFORE AFTER [--renamed MAP.json] [--json TABLE.json]

Make the data once, by the code before the change. Run before and after (about half an hour of one
processor each; what OUT holds is not run again), and compare. Only the command lines of
pamsim and of the tests' plant are used: the modules may move. Which code runs is PYTHON's, or that
of an absolute PYTHONPATH.

A map of renamed keys describes results whose shape has changed on purpose. It holds, per command
(``*`` stands for anything), old places and new ones, null for what is not compared, on either side.
What lies below a place moves with it, and each ``*`` of the new is that of the old. Where values
are written otherwise too, a rule holds the new place, and the new words or a new unit's factor:

    {"diagnose_*": {"result/base[*]/after": "result/nuisance[*]/refitted",
                    "result/schema": null},
     "replicate": {"result/claims[*]/id": {"place": "result/claims[*]/id",
                                           "values": {"A-*": "matiskova2021-*"}}}}
"""

from __future__ import annotations

import cmath
import csv
import fnmatch
import hashlib
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import click
from tqdm import tqdm

FORCE_MAP = Path(__file__).parent.parent / "pamsim" / "data" / "dmsp20_300_force_map.csv"

PLANT = "tests.plant.hide"
"""In place of a command of pamsim: the module that hides effects in the independent plant."""

PROTOCOLS = "triangle,staircase,multisine,bursts,loaded_steps"

# Name -> effects, their sizes, seed, further options of `pamsim hide`. Sizes and seeds are those of
# the blind study where it has such a data set; they were chosen so that every verdict appears.
_COLOURED = ("--coloured",)
_DIFFERENT = ("--formulation", "independent")
SYNTHETIC: dict[str, tuple[str, str, int, tuple[str, ...]]] = {
    "none_white": ("none", "1", 17000, ("--variation", "0")),
    "none_coloured": ("none", "1", 17014, _COLOURED),
    "supply_sag_small": ("supply_sag", "0.0849", 17078, ()),
    "coulomb_friction": ("coulomb_friction", "0.1555", 17043, _COLOURED),
    "air_leak_large": ("air_leak", "2.3432", 17077, _COLOURED),
    "muscle_hysteresis_large": ("muscle_hysteresis", "0.1907", 17059, _COLOURED),
    "muscle_hysteresis_small": ("muscle_hysteresis", "0.033", 17057, _COLOURED),
    "valve_delay_small": ("valve_delay", "0.2273", 17090, ()),
    "chain_backlash": ("chain_backlash", "0.18", 17097, _COLOURED),
    "angle_bias": ("angle_bias", "0.4103", 17103, _COLOURED),
    "thermal_relaxation": ("thermal_relaxation", "0.7826", 17088, ()),
    "pressure_lag": ("pressure_lag", "0.681", 17118, ()),
    "pressure_scale": ("pressure_scale", "0.1739", 17115, _COLOURED),
    "end_shape_valve_flow": ("end_shape+valve_flow", "1.7321,0.4209", 17155, ()),
    "viscoelastic_creep_supply_sag": (
        "viscoelastic_creep+supply_sag", "0.1561,0.2685", 17149, (),
    ),
    "different_valve_flow": ("valve_flow", "0.4209", 17133, _DIFFERENT),
    "different_viscous_friction": ("viscous_friction", "0.8227", 17122, _DIFFERENT),
    "different_coulomb_friction": ("coulomb_friction", "0.22", 17120, _DIFFERENT),
    "different_line_lag": ("line_lag", "0.3672", 17136, (*_DIFFERENT, *_COLOURED)),
    "quadratic_drag": ("quadratic_drag", "1", 17165, _DIFFERENT),
    "ageing_drift": ("ageing_drift", "3", 17160, (*_DIFFERENT, *_COLOURED)),
    "loaded_friction": ("loaded_friction", "1", 17173, (*_DIFFERENT, *_COLOURED)),
    "load_torque": ("load_torque", "1.0462", 17178, _COLOURED),
    "valve_flow_unrepeated": ("valve_flow", "0.7685", 1, ("--repeats", "1")),
}  # fmt: skip

DIAGNOSIS_OPTIONS = {
    "load_torque": ("--effects", "angle_bias,angle_scale,coulomb_friction,passive_stiffness"),
    "angle_bias": ("--nuisance", "force.scale,chamber.dead_volume"),
}
"""Data set -> options beside the seed; all effects are tried where none stand here."""

STEPS = {
    "pressure_step": (
        "step", "--pressure", "400,100", "--start", "300,300", "--load", "1.2kg",
        "--duration", "4",
    ),
    "valve_step": ("step", "--valve", "0.5,-0.5", "--start", "2bar,2bar", "--duration", "500ms"),
}  # fmt: skip

SHORT_RECORDING = (
    "hide", "air_leak", "--protocols", "staircase,bursts", "--duration", "3s", "--repeats", "3",
)  # fmt: skip

IGNORED = {"seconds", "processor_seconds", "wall_s", "versions", "mujoco", "command_line"}
"""Keys of what may change from run to run, or from machine to machine."""


def hidden(name: str) -> tuple[str, ...]:
    """Arguments that make the data of a synthetic recording."""
    effects, sizes, seed, more = SYNTHETIC[name]
    setting = ("--protocols", PROTOCOLS, "--duration", "5s", "--seed", str(seed))
    return (PLANT if "--formulation" in more else "hide", effects, "--size", sizes, *setting, *more)


def data_commands() -> dict[str, tuple[str, ...]]:
    """Folder in the data -> arguments that fill it."""
    return {**STEPS, "short_twin": SHORT_RECORDING, **{name: hidden(name) for name in SYNTHETIC}}


def commands() -> dict[str, tuple[str, ...]]:
    """Name -> arguments. They run beside a folder ``data`` and may write to ``out``."""
    valves = "valve.conductance_fill,valve.conductance_exhaust"
    braid = ("--diameter", "20", "--fibre-angle", "28.6")
    calibrate, diagnose = ("calibrate", "--threads", "1"), ("diagnose", "--threads", "1")
    table: dict[str, tuple[str, ...]] = {
        "models": ("models",),
        "hide": (*SHORT_RECORDING, "--out", "out"),
        "hide_different": (
            PLANT, "cogging_torque+air_leak", "--size", "2,1", *_DIFFERENT, "--protocols",
            "triangle,bursts", "--duration", "2s", "--repeats", "2", "--coloured",
            "--no-forces", "--seed", "5", "--out", "out",
        ),
        "step": (*STEPS["pressure_step"], "--out", "out"),
        "step_valve_sensors": (*STEPS["valve_step"], "--sensors", "--out", "out"),
        "fit_printed_law": (
            "fit", "data/force_map.csv", "--model", "six_parameter", "--hold-out", "pressure",
        ),
        "fit_force_map": (
            "fit", "data/measured_force_map.csv", "--model", "mooney_rivlin", *braid,
            "--out", "out",
        ),
        "fit_compare": ("fit", "data/thinned_force_map.csv", "--compare", *braid),
        "fit_branches": (
            "fit", "data/length_loop.csv", "--model", "arctangent", "--hold-out", "none",
            "--nominal-length", "300", "--out", "out",
        ),
        "fit_maxwell": (
            "fit", "data/force_loops.csv", "--compare", "--nominal-length", "300", "--out", "out",
        ),
        "identify_recording": ("identify", "data/pressure_step", "--out", "out"),
        "identify_simulated": (
            "identify", "--simulate", "mas20_arm", "--order", "2", "--dead-time", "none",
        ),
        "identify_held_out": (
            "identify", "data/none_white", "--protocol", "staircase", "--protocol",
            "staircase_check", "--input", "p1_kpa-p2_kpa", "--hold-out", "staircase_check_1",
        ),
        "calibrate_step": (*calibrate, "data/valve_step", "--free", valves, "--out", "out"),
        "calibrate_profile": (
            *calibrate, "data/short_twin", "--free", valves, "--hold-out", "bursts_check",
            "--starts", "2", "--profile", "valve.conductance_fill",
        ),
        "calibrate_mas20": (*calibrate, "mas20"),
        "reproduce": ("reproduce", "--out", "out"),
        "replicate": ("replicate",),
        "length_loop_table": ("diagnose", "data/length_loop.csv"),
        "length_loop_means": ("diagnose", "alraouf2025"),
        "length_loop_equations": ("diagnose", "alraouf2025_equations"),
        "length_loop_moving": (
            "diagnose", "alraouf2025_equations", "--effects",
            "muscle_hysteresis,viscoelastic_creep,viscous_friction,drift",
        ),
        "diagnose_mas20": (*diagnose, "mas20"),
        "diagnose_short_twin": (
            *diagnose, "data/short_twin", "--effects", "air_leak,pressure_bias", "--out", "out",
        ),
    }  # fmt: skip
    for name, (_, _, seed, _) in SYNTHETIC.items():
        more = DIAGNOSIS_OPTIONS.get(name, ())
        table[f"diagnose_{name}"] = (*diagnose, f"data/{name}", "--seed", str(seed), *more)
    return table


def write_tables(folder: Path) -> None:
    """Force maps and loops to fit laws to: a measured map, and points of printed laws."""
    shutil.copyfile(FORCE_MAP, folder / "measured_force_map.csv")
    lines = FORCE_MAP.read_text(encoding="utf-8").splitlines()
    kept = lines[:2] + [line for i, line in enumerate(lines[2:]) if (i // 6) % 3 == 2]
    (folder / "thinned_force_map.csv").write_text("\n".join(kept) + "\n", encoding="utf-8")

    def force(bar: float, kappa: float) -> float:  # DMSP-20-200, p in bar
        decay = (-4.00180705 * bar + 292.4620246) * math.exp(-32.930845 * kappa)
        return decay - 933.564098 * bar * kappa + 294.0538256 * bar - 280.498151

    _write_rows(
        folder / "force_map.csv",
        ("p_kpa", "contraction", "force_n"),
        ((100 * p, k, force(p, k)) for p in (1, 2, 3, 4, 5) for k in (0, 0.02, 0.05, 0.1, 0.15)),
    )
    branches = {
        "up": (2.7378, -0.0083212, 1.3402, 27.759),
        "down": (2.7854, -0.0088259, 1.1891, 27.87),
    }
    _write_rows(
        folder / "length_loop.csv",
        ("p_kpa", "length_cm", "branch"),
        (
            (p, k0 * math.atan(k1 * p + k2) + k3, branch)
            for branch, (k0, k1, k2, k3) in branches.items()
            for p in (range(0, 501, 50) if branch == "up" else range(500, -1, -50))
        ),
    )

    def loop(hz: int) -> Iterator[tuple[Any, ...]]:  # fractional Maxwell element under 150 N
        wave = (2j * math.pi * hz * 0.05) ** 0.4
        compliance = (1.0 + wave) / (2e4 * wave)
        for i in range(126):
            turn = 0.1 * i
            x = (compliance * 150.0 * cmath.exp(1j * turn)).imag
            yield hz, turn / (2 * math.pi * hz), 150.0 * math.sin(turn), 1e3 * x

    _write_rows(
        folder / "force_loops.csv",
        ("loop", "time_s", "force_n", "displacement_mm"),
        (row for hz in (1, 3, 10) for row in loop(hz)),
    )


def _write_rows(path: Path, head: tuple[str, ...], rows: Iterable[tuple[Any, ...]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([head, *rows])


def pamsim(python: str, arguments: Iterable[str], folder: Path) -> tuple[int, str]:
    """Run the command in a folder, on one thread.

    Returns:
        Exit code, and the last line on standard error.
    """
    arguments = list(arguments)
    plant = arguments[0] == PLANT
    how = ["-m"] if plant else ["-c", "from pamsim.cli.main import main; main()"]
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    done = subprocess.run(
        [python, *how, *arguments],
        cwd=folder,
        env={**os.environ, **threads},
        capture_output=True,
        text=True,
    )
    lines = done.stderr.strip().splitlines()
    return done.returncode, lines[-1] if lines else ""


def answer(python: str, arguments: tuple[str, ...], data: Path) -> dict[str, Any]:
    """Run a command; its exit code, its result, and the tables and settings that it wrote.

    Raises:
        click.ClickException: if it gave no result.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "data").symlink_to(data.resolve(), target_is_directory=True)
        began = time.perf_counter()
        code, error = pamsim(python, [*arguments, "--json", "result.json"], folder)
        seconds = time.perf_counter() - began
        result, out = folder / "result.json", folder / "out"
        if not result.exists():
            raise click.ClickException(f"{' '.join(arguments)}: exit code {code}: {error}")
        return {
            "command_line": ["pamsim", *arguments],
            "exit_code": code,
            "seconds": round(seconds, 1),
            "result": json.loads(result.read_text(encoding="utf-8")),
            "files": {
                path.relative_to(out).as_posix(): written(path)
                for path in sorted(out.rglob("*"))
                if path.suffix in (".csv", ".toml")
            },
        }


def written(path: Path) -> dict[str, Any]:
    """What a file holds: of settings, all; of a table, its hash and the sums of its columns."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".toml":
        return tomllib.loads(text)
    columns: dict[str, list[float]] = {}
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    for row in rows:
        for name, cell in row.items():
            try:
                columns.setdefault(name, []).append(float(cell))
            except ValueError:  # a word, or nothing measured
                continue
    return {
        "sha256": hashlib.sha256(text.encode()).hexdigest(),
        "rows": len(rows),
        "sums": {name: math.fsum(values) for name, values in columns.items()},
    }


def places(value: Any, at: str = "") -> Iterator[tuple[str, Any]]:
    """Every number, word and empty list of a result with its place, such as ``effects[0]/name``."""
    if isinstance(value, dict) and value:
        for key, inner in value.items():
            if key not in IGNORED:
                yield from places(inner, f"{at}/{key}" if at else key)
    elif isinstance(value, list) and value:
        for i, inner in enumerate(value):
            yield from places(inner, f"{at}[{i}]")
    else:
        yield at, value


class Rule(NamedTuple):
    """A place that was renamed.

    Attributes:
        old: pattern of the old place.
        new: the new place; None for what is not compared.
        values: old word -> new word; a ``*`` stands for anything.
        factor: on numbers, where the unit has changed.
    """

    old: re.Pattern[str]
    new: str | None
    values: Mapping[str, str]
    factor: float


def rules_of(renamed: Mapping[str, Any]) -> list[Rule]:
    """Rules of a map of renamed keys; of an old place the first that fits counts.

    Raises:
        click.ClickException: for a rule with an unknown key.
    """
    rules: list[Rule] = []
    for old, new in renamed.items():
        more = dict(new) if isinstance(new, dict) else {"place": new}
        place, values, factor = (
            more.pop(k, d) for k, d in (("place", old), ("values", {}), ("factor", 1))
        )
        if more:
            raise click.ClickException(f"{old}: unknown {', '.join(more)}")
        rules.append(Rule(_pattern(old, r"[^/\[\]]+", r"(?=[/\[]|$)"), place, values, factor))
    return rules


def _pattern(text: str, star: str, end: str = "$") -> re.Pattern[str]:
    return re.compile(re.escape(text).replace(r"\*", f"({star})") + end)


def _filled(text: str, match: re.Match[str]) -> str:
    """A text with what the stars of a pattern stood for."""
    stars = iter(match.groups())
    return re.sub(r"\*", lambda _: next(stars), text)


def renamed_values(
    values: Mapping[str, Any], rules: Iterable[Rule], *, is_old: bool
) -> dict[str, Any]:
    """Values by their new places, without those that are not compared.

    Args:
        values: place -> value.
        rules: see `rules_of`.
        is_old: whether the places are old ones; new ones stay, but for what is not compared.

    Raises:
        click.ClickException: if two places with different values become one.
    """
    kept: dict[str, Any] = {}
    for old, value in values.items():
        place, new = old, value
        for rule in rules:
            match = rule.old.match(old)
            if match is None or (rule.new is not None and not is_old):
                continue
            place = None if rule.new is None else _filled(rule.new, match) + old[match.end() :]
            new = _renamed_value(value, rule)
            break
        if place is None:
            continue
        if kept.setdefault(place, new) != new:
            raise click.ClickException(f"two old places are {place} now: {kept[place]} and {new}")
    return kept


def _renamed_value(value: Any, rule: Rule) -> Any:
    if _is_number(value):
        return value if rule.factor == 1 else value * rule.factor
    for old, new in rule.values.items():
        match = _pattern(old, ".*").match(value) if isinstance(value, str) else None
        if match:
            return _filled(new, match)
    return value


MISSING = object()
"""Stands for a value on the side where its place does not exist."""

_EMPTY = (None, "", [], {})
"""Values that say nothing: a place that holds one and is on one side only is no difference."""


class Difference(NamedTuple):
    """A value that differs; ``relative`` is infinite where either side is no number."""

    place: str
    before: Any
    after: Any
    relative: float

    @property
    def kind(self) -> str:
        """What happened to the place."""
        if self.after is MISSING:
            return "gone"
        return "added" if self.before is MISSING else "differs"


def differences(
    before: Mapping[str, Any], after: Mapping[str, Any], rtol: float, atol: float
) -> tuple[list[Difference], float]:
    """What differs, and the largest relative difference of all numbers, tolerated ones too."""
    differing, largest = [], 0.0
    for place in dict.fromkeys([*before, *after]):
        old, new = before.get(place, MISSING), after.get(place, MISSING)
        if (old is MISSING and new in _EMPTY) or (new is MISSING and old in _EMPTY):
            continue
        if not (_is_number(old) and _is_number(new)):
            if type(old) is not type(new) or old != new:
                differing.append(Difference(place, old, new, math.inf))
        elif old != new:
            scale = max(abs(old), abs(new))
            relative = abs(old - new) / scale
            if abs(old - new) > atol:
                largest = max(largest, relative)
            if abs(old - new) > max(atol, rtol * scale):
                differing.append(Difference(place, old, new, relative))
    return differing, largest


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def grouped(differing: Iterable[Difference]) -> dict[tuple[str, str], list[Difference]]:
    """Kind of difference and place, with list indices left out -> differences, the worst first."""
    groups: dict[tuple[str, str], list[Difference]] = {}
    for difference in differing:
        place = re.sub(r"\[\d+\]", "[*]", difference.place)
        groups.setdefault((difference.kind, place), []).append(difference)
    return {
        key: sorted(members, key=lambda d: d.relative, reverse=True)
        for key, members in sorted(groups.items())
    }


def table_row(
    before: Mapping[str, Any], after: Mapping[str, Any], rtol: float, atol: float
) -> dict[str, Any]:
    """The comparison of a command's answers, as it is written to the table.

    Args:
        before: place -> value, by the new places.
        after: the same.
        rtol: see `differences`.
        atol: see `differences`.
    """
    differing, largest = differences(before, after, rtol, atol)
    groups = grouped(differing)

    def places_of(kind: str) -> dict[str, int]:
        return {place: len(group) for (own, place), group in groups.items() if own == kind}

    return {
        "compared": len(before.keys() & after.keys()),
        "differ": sum(d.kind == "differs" for d in differing),
        "largest_relative": largest,
        "verdicts": [side.get("result/verdict") for side in (before, after)],
        "differences": {
            place: {
                "values": len(group),
                "relative": group[0].relative if math.isfinite(group[0].relative) else None,
                "before": group[0].before,
                "after": group[0].after,
            }
            for (kind, place), group in groups.items()
            if kind == "differs"
        },
        "gone": places_of("gone"),
        "added": places_of("added"),
    }


def table_lines(row: Mapping[str, Any]) -> Iterator[str]:
    """A line for each group of differences of a command."""
    for place, d in row["differences"].items():
        size = "" if d["relative"] is None else f" by {d['relative']:.2g}"
        change = f"{_short(d['before'])} -> {_short(d['after'])}"
        yield f"{place}: {d['values']} differ{size}: {change}"
    for kind in ("gone", "added"):
        for place, count in row[kind].items():
            yield f"{place}: {count} {kind}"


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _values(file: Path) -> dict[str, Any]:
    return dict(places(json.loads(file.read_text(encoding="utf-8")))) if file.exists() else {}


def _chosen(table: Iterable[str], only: tuple[str, ...]) -> list[str]:
    return [n for n in table if not only or any(fnmatch.fnmatch(n, pattern) for pattern in only)]


_FOLDER = click.Path(path_type=Path, file_okay=False)
_python = click.option("--python", default=sys.executable, help="Interpreter that has pamsim.")
_only = click.option("--only", multiple=True, metavar="NAME", help="Of these names; * is any.")


@click.group()
def cli() -> None:
    """Freeze what the commands answer, and compare."""


@cli.command(name="data")
@click.argument("folder", type=_FOLDER)
@_python
def make_data(folder: Path, python: str) -> None:
    """Make the data that the commands read in FOLDER/data; what is there stays."""
    data = folder.resolve() / "data"
    data.mkdir(parents=True, exist_ok=True)
    write_tables(data)
    for name, arguments in tqdm(data_commands().items(), unit="data set"):
        if not (data / name / "recording.toml").exists():
            code, error = pamsim(python, [*arguments, "--out", name], data)
            if code:
                raise click.ClickException(f"{name}: exit code {code}: {error}")


@cli.command(name="run")
@click.argument("folder", type=_FOLDER)
@click.argument("out", type=_FOLDER)
@_only
@_python
def run_commands(folder: Path, out: Path, only: tuple[str, ...], python: str) -> None:
    """Run the commands on FOLDER/data and keep every answer in OUT/NAME.json.

    A command that gives no answer stops the run with its error; the same call goes on from there.
    """
    where = [python, "-c", "import pamsim; print(pamsim.__file__)"]
    click.echo(subprocess.run(where, cwd=folder, capture_output=True, text=True).stdout.strip())
    out.mkdir(parents=True, exist_ok=True)
    table = commands()
    bar = tqdm(_chosen(table, only), unit="command")
    for name in bar:
        bar.set_description(name)
        file = out / f"{name}.json"
        if not file.exists():
            kept = answer(python, table[name], folder / "data")
            file.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
            verdict = kept["result"].get("verdict", "")
            bar.write(f"{name}: exit {kept['exit_code']}, {kept['seconds']} s {verdict}")


@cli.command()
@click.argument("before", type=_FOLDER)
@click.argument("after", type=_FOLDER)
@click.option("--rtol", default=1e-9, show_default=True, help="Numbers as near as this are equal.")
@click.option("--atol", default=1e-12, show_default=True, help="Or as near as this, in their unit.")
@click.option("--renamed", type=click.Path(path_type=Path, exists=True), help="Map of keys (JSON).")
@click.option(
    "--commits", nargs=2, default=("", ""), help="Before and after, as the table names them."
)
@click.option("--json", "table", type=click.Path(path_type=Path), help="Write the table here.")
@_only
def compare(
    before: Path,
    after: Path,
    rtol: float,
    atol: float,
    renamed: Path | None,
    commits: tuple[str, str],
    table: Path | None,
    only: tuple[str, ...],
) -> None:
    """Compare the answers in two folders; exit 1 if any differs or is on one side only."""
    maps = {} if renamed is None else json.loads(renamed.read_text(encoding="utf-8"))
    names = {file.stem for folder in (before, after) for file in folder.glob("*.json")}
    rows: dict[str, Any] = {}
    lines: list[str] = []
    head = ("command", "compared", "differ", "largest", "gone", "added")
    click.echo("{:42s} {:>8s} {:>7s} {:>9s} {:>6s} {:>6s}".format(*head))
    for name in _chosen(sorted(names), only):
        fitting = [own for pattern, own in maps.items() if fnmatch.fnmatch(name, pattern)]
        rules = [rule for own in fitting for rule in rules_of(own)]
        old, new = (_values(folder / f"{name}.json") for folder in (before, after))
        if not (old and new):
            lines.append(f"{name}: no answer in {after if old else before}")
            continue
        row = table_row(
            renamed_values(old, rules, is_old=True),
            renamed_values(new, rules, is_old=False),
            rtol,
            atol,
        )
        rows[name] = row
        gone, added = (sum(row[kind].values()) for kind in ("gone", "added"))
        click.echo(
            f"{name:42s} {row['compared']:8d} {row['differ']:7d} {row['largest_relative']:9.2g}"
            f" {gone:6d} {added:6d}"
        )
        lines += [f"{name}: {line}" for line in table_lines(row)]
    for line in lines:
        click.echo(line)
    if table is not None:
        added = Counter(place for row in rows.values() for place in row.pop("added"))
        content = {
            "command": f"python scripts/freeze_results.py compare BEFORE AFTER --renamed {renamed}",
            "commits": commits,
            "rtol": rtol,
            "atol": atol,
            "commands": rows,
            "added": dict(sorted(added.items())),
        }
        table.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    sys.exit(1 if lines or not names else 0)


if __name__ == "__main__":
    cli()
