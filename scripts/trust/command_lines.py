"""Whether any command line ends in a result, one line, or an interruption; nothing else.

    python scripts/trust/command_lines.py [--runs 1000] [--seed 0] [--seconds 2] [--json FILE]

Commands and options are drawn from the command line's own tree, values of any kind: right ones,
names of other things, numbers at the edges, files of another format. What still runs after
``--seconds`` is interrupted as by Ctrl-C, at that moment wherever it is. A run fails by a
traceback, by an exit code other than 0, 1, 2 and 130, by no line or several lines of error with
code 2, or if it does not end in 10 s more. Exits 1 if a run fails.
"""

from __future__ import annotations

import json
import shutil
import signal
import sys
import tempfile
import warnings
from pathlib import Path

import click
import grammars
import matplotlib as mpl
import numpy as np
from tqdm import tqdm
from writing_commands import Process, emptied

import pamsim
from pamsim.cli.main import BAD_INPUT, INTERRUPTED, cli
from pamsim.recordings.recording import write_recording
from pamsim.recordings.rig_file import shipped_rigs

sys.path.insert(0, str(Path(__file__).parents[1]))
from records import head, parser, write

ENDS = 10.0
"""Time for an interrupted command to end [s]: it may have to finish a fit's simulation."""
ELSEWHERE = frozenset({"view", "train"})
"""Commands that open a window, or need an extra. ``--verbose``, which asks for tracebacks, is left
out, too."""


def prepared(folder: Path) -> list[str]:
    """Good files and folders of every kind, and some that are none."""
    rig = pamsim.load_rig("mas20_arm")
    step = pamsim.pressure_step((3e5, 3e5), (3e5, 2e5), duration=0.3, load=1.2)
    write_recording(folder / "data", "mas20_arm", {"step": pamsim.simulate(rig, step)})
    shutil.copytree(shipped_rigs() / "mas20_arm", folder / "rig")
    shutil.copyfile(grammars.POLICY, folder / "policy.npz")
    (folder / "study.toml").write_text('schema = "pamsim-sweep/1"\n', encoding="utf-8")
    (folder / "empty").mkdir()
    rng = np.random.default_rng(0)
    for name, content in (
        ("map.csv", grammars.force_map(rng)),
        ("log.csv", grammars.log(rng)),
        ("bytes", rng.bytes(200)),
    ):
        (folder / name).write_bytes(content)
    return [*sorted(path.name for path in folder.iterdir()), "data/recording.toml", "no_such"]


def leaves(
    group: click.Group, path: tuple[str, ...] = ()
) -> list[tuple[tuple[str, ...], click.Command]]:
    """Every command with the words that name it."""
    found: list[tuple[tuple[str, ...], click.Command]] = []
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if isinstance(command, click.Group):
            found += leaves(command, (*path, name))
        elif command is not None and name not in ELSEWHERE:
            found.append(((*path, name), command))
    return found


def word(rng: np.random.Generator, parameter: click.Parameter, files: list[str]) -> str:
    """A value for a parameter, more often than not of its kind."""
    kind, pick = parameter.type, rng.random()
    if isinstance(kind, click.Choice) and pick < 0.7:
        return str(kind.choices[int(rng.integers(len(kind.choices)))])
    if pick < 0.4:
        return files[int(rng.integers(len(files)))]
    if pick < 0.7:
        number = f"{grammars.number(rng):.6g}"
        unit = grammars.UNITS[int(rng.integers(len(grammars.UNITS)))]
        return (number, number + unit, f"{number},{number}", f"joint.shaft.damping={number}")[
            int(rng.integers(4))
        ]
    known = ("mas20_arm", "coulomb_friction", "air_leak", "step", "staircase", "six_parameter", "1")
    some = known if pick < 0.9 else grammars.WORDS
    return some[int(rng.integers(len(some)))]


def line(rng: np.random.Generator, files: list[str]) -> list[str]:
    """A command line."""
    every = leaves(cli)
    path, command = every[int(rng.integers(len(every)))]
    words = list(path)
    for parameter in command.params:
        if isinstance(parameter, click.Argument):
            count = int(rng.integers(0, 3)) if parameter.nargs < 0 else int(rng.random() < 0.95)
            words += [word(rng, parameter, files) for _ in range(count)]
        elif parameter.name != "verbose" and rng.random() < (0.9 if parameter.required else 0.15):
            flag = (*parameter.opts, *parameter.secondary_opts)
            words.append(flag[int(rng.integers(len(flag)))])
            if not getattr(parameter, "is_flag", False):
                words.append("out" if "--out" in flag else word(rng, parameter, files))
    return [*words, *(["--no-open"] if path[-1] == "demo" else [])]


def ended(words: list[str], folder: Path, seconds: float) -> tuple[int | None, str]:
    """Exit code and stderr of a command, interrupted after its time; None if it goes on then."""
    process = Process(tuple(words), folder)
    late = False
    if not process.ends_in(seconds):
        process.send(signal.SIGINT)
        late = not process.ends_in(ENDS)
    if late:
        process.send(signal.SIGKILL)
    end = process.wait()
    return None if late else end.code, end.errors


def fault(code: int | None, text: str) -> str:
    """What is wrong with how a command line ended; empty if nothing is."""
    if code is None:
        return f"does not end in {ENDS:g} s after it was interrupted"
    if "Traceback" in text:
        return f"a traceback: {text.splitlines()[-1][:80]}"
    if code not in (0, 1, BAD_INPUT, INTERRUPTED):
        return f"exit code {code}"
    errors = [one for one in text.splitlines() if one.strip() and "warning" not in one.lower()]
    shown = [one for one in errors if "error:" in one.lower()]
    if code == BAD_INPUT and len(shown) != 1:
        return f"{len(shown)} lines of error: {errors[:2]}"
    return ""


def run() -> None:
    """Run, print, write."""
    asked = parser(__doc__, runs=1000, seed=0)
    asked.add_argument("--seconds", type=float, default=2.0)
    options = asked.parse_args()
    mpl.use("agg")
    warnings.simplefilter("ignore")
    tqdm.monitor_interval = 0  # no thread beside: the process forks
    faults: list[tuple[int, str, str]] = []
    with tempfile.TemporaryDirectory() as place:
        good, folder = Path(place) / "good", Path(place) / "folder"
        good.mkdir()
        files = prepared(good)  # compiles, and imports what all runs need
        leaves(cli)
        for number in tqdm(range(options.runs), unit="run"):
            words = line(np.random.default_rng([options.seed, number]), files)
            code, errors = ended(words, emptied(folder, like=good), options.seconds)
            if what := fault(code, errors):
                faults.append((number, what, " ".join(words)))
                print(json.dumps(faults[-1]), flush=True)
    result = head("python scripts/trust/command_lines.py --runs N --seed S")
    result |= {"seed": options.seed, "runs": options.runs, "failed": faults}
    write(result, options.json)
    print(f"{len(faults)} failed")
    sys.exit(int(bool(faults)))


if __name__ == "__main__":
    run()
