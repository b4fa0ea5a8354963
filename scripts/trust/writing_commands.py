"""The commands of pamsim that write, each in a process of its own, and what they leave behind.

Used by ``kills.py``, ``disk_full.py``, ``interrupts.py`` and ``command_lines.py``. A process is a
fork of one that has imported pamsim, so that hundreds of runs need not import it again. Inputs are
small, so that a run takes seconds.
"""

from __future__ import annotations

import atexit
import importlib
import importlib.util
import json
import mmap
import os
import pkgutil
import re
import shutil
import signal
import struct
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np
import pyarrow
import tqdm
from pyarrow import parquet

import pamsim
from pamsim.__main__ import program
from pamsim.core.errors import PamsimError
from pamsim.core.files import LOCK

sys.path.insert(0, str(Path(__file__).parents[1]))
from records import head, parser, read, write

LONGEST = 600.0
"""Of a run [s]; what takes longer is blocked."""

SAME_COLOUR, OTHER_PIXELS = 8, 1e-3
"""Levels of 255 by which a pixel may differ and be the same, and share of pixels that may not."""

IN = "../inputs"
"""Of the commands, which run in a folder beside it."""

INPUTS = (
    "hide coulomb_friction --size 0.5 --protocols triangle --repeats 6 --duration 800ms"
    " --out recording",
    "step --pressure 400,100 --start 300,300 --duration 1s --out step",
)


@dataclass(frozen=True)
class Command:
    """A command that writes.

    Attributes:
        line: arguments of ``pamsim``, in an empty folder beside `IN`.
        share: of the tries, relative to the others; less for those that take long.
        checkpoint: file that ``--resume`` goes on from; none if empty.
        near: relative difference that a resumed run may leave; 0 for none. A search that goes on
            where it was takes a trust region of the first size again, and so other steps.
        kept: folder of what is finished, which is gone in the end; none if empty.
        needs: package without which it is left out.
    """

    line: str
    share: float = 1.0
    checkpoint: str = ""
    kept: str = ""
    near: float = 0.0
    needs: str = ""

    @property
    def args(self) -> tuple[str, ...]:
        """The words of the line."""
        return tuple(self.line.split())


COMMANDS = {
    "step": Command(
        "step --pressure 400,100 --start 300,300 --duration 1s --out out --json step.json",
        share=1.4,
    ),
    "identify": Command(f"identify {IN}/step --order 1 --out out --json one.json", share=1.4),
    "fit": Command(
        f"fit {IN}/map.csv --model six_parameter --nominal-length 300 --out out --json fit.json",
        share=1.4,
    ),
    "new-rig": Command("new-rig arm --kind joint --out out", share=3.5),
    "import": Command(
        f"import {IN}/log.csv --rig mas20_arm --column shaft.angle=phi:deg --column"
        " muscle_1.pressure=p1:kPa --column muscle_2.pressure=p2:kPa --out out --json import.json",
        share=3.7,
    ),
    "check": Command(
        f"check {IN}/recording --effects coulomb_friction --out out --json check.json", share=1.4
    ),
    "calibrate": Command(
        f"calibrate {IN}/recording --free joint.shaft.damping --hold-out triangle_check --starts 2"
        " --out out --json fit.json",
        share=1.4,
        checkpoint="out/checkpoint.json",
        near=1e-6,
    ),
    "diagnose": Command(
        f"diagnose {IN}/recording --effects coulomb_friction --out out --json found.json", share=0.8
    ),
    "hide": Command(
        "hide coulomb_friction --protocols triangle --repeats 3 --duration 1s --out out"
        " --json hidden.json",
        share=2.0,
    ),
    "replicate": Command("replicate --paper alraouf2025 --out out --json all.json", share=0.6),
    "reproduce": Command("reproduce --out out --json all.json", share=0.5),
    "render": Command(
        f"render film.gif --recording {IN}/step --fps 5 --width 400 --height 320", share=0.6
    ),
    "render mp4": Command(
        f"render film.mp4 --recording {IN}/step --fps 5 --width 400 --height 320",
        share=0.5,
        needs="imageio_ffmpeg",
    ),
    "render png": Command("render rest.png --width 320 --height 256", share=0.8),
    "train": Command("train --steps 6400 --out policy.npz", share=0.3, needs="torch"),
    "sweep": Command(
        f"sweep {IN}/study.toml --out out --json all.json",
        checkpoint="out/study.json",
        kept="out/chunks/",
    ),
}

_LEFT_OUT = {"demo": "half a minute; it is hide and diagnose, which are tried"}
"""Commands that are left out everywhere -> why."""

_STUDY = """
schema = "pamsim-sweep/1"
rig = "mas20_arm"
design = "sobol"
runs = 512
seed = 1
[experiment]
drive = "pressure_set"
start_pressure = [300, 300]
final = [300, 100]
duration = 0.1
settle = 0.2
[vary.load]
low = 0
high = 2
unit = "kg"
"""

_TIMES = {"seconds", "wall_s"}
"""Keys of durations: what differs between two runs that nothing interrupts."""
_COUNTS = {"evaluations", "calls", "iterations", "simulations", "steps", "diverged", "rollouts",
           "parameter_sets", "kept"}  # fmt: skip
"""Keys of what a run took, in simulations: less where it was resumed."""
_COUNT = re.compile(r"(?<=>)\d+(?=<)|\d+(?= runs kept)")
_DURATION = re.compile(r"\d+(\.\d+)? s\b")


def left_out() -> dict[str, str]:
    """Commands that are not tried -> why."""
    return _LEFT_OUT | {
        name: f"needs {command.needs}"
        for name, command in COMMANDS.items()
        if command.needs and importlib.util.find_spec(command.needs) is None
    }


def prepare(root: Path) -> None:
    """Import pamsim whole, compile what is not compiled, and write the inputs below a folder."""
    for module in pkgutil.walk_packages(pamsim.__path__, "pamsim."):
        if not module.name.endswith("__main__"):
            try:
                importlib.import_module(module.name)
            except ImportError:
                continue
    inputs = root / "inputs"
    inputs.mkdir()
    time_s = np.arange(200) * 0.01
    p1 = np.where(time_s % 1.0 < 0.5, 300.0, 100.0)
    log = np.column_stack([time_s, p1, 400.0 - p1, 0.05 * (2.0 * p1 - 400.0)])
    np.savetxt(inputs / "log.csv", log, "%.6g", ",", header="t,p1,p2,phi", comments="")
    shipped = Path(pamsim.__file__).parent / "data" / "dmsp20_300_force_map.csv"
    shutil.copyfile(shipped, inputs / "map.csv")
    (inputs / "study.toml").write_text(_STUDY, encoding="utf-8")
    for line in INPUTS:
        Process(tuple(line.split()), inputs).wait().check()


@dataclass(frozen=True)
class Ended:
    """How a process ended: exit code (negative for a signal), stderr, time [s], and writes."""

    code: int
    errors: str
    seconds: float
    writes: int

    def check(self) -> Ended:
        """Itself; RuntimeError if it failed."""
        if self.code not in (0, 1):
            raise RuntimeError(f"exit code {self.code}: {self.errors}")
        return self


class Process:
    """``pamsim`` with some arguments, in a folder.

    Args:
        args: of ``pamsim``.
        folder: to run in; it must be there.
        at: event of writing before which it gets `sent`; never if 0.
        sent: signal that it sends to itself.
    """

    def __init__(
        self, args: tuple[str, ...], folder: Path, at: int = 0, sent: int = signal.SIGKILL
    ) -> None:
        self._args, self._folder, self._at, self._sent = args, folder.resolve(), at, sent
        self._count = mmap.mmap(-1, 4)
        self._errors = folder.parent / f"{folder.name}.stderr"
        self._begun = time.monotonic()
        self.pid = os.fork()
        if self.pid == 0:
            self._be()

    def writes(self) -> int:
        """Events of writing so far."""
        return struct.unpack("i", self._count[:4])[0]

    def runs(self) -> bool:
        """Whether it has not ended; an ended one stays until `wait`, its number in use."""
        return os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None

    def ends_in(self, seconds: float) -> bool:
        """Wait for its end, so long at most; whether it has ended."""
        due = time.monotonic() + seconds
        while self.runs() and time.monotonic() < due:
            time.sleep(min(0.002, max(0.0, due - time.monotonic())))
        return not self.runs()

    def send(self, what: int) -> None:
        """Send it a signal."""
        os.kill(self.pid, what)

    def wait(self) -> Ended:
        """Wait for its end."""
        _, status = os.waitpid(self.pid, 0)
        return Ended(
            os.waitstatus_to_exitcode(status),
            self._errors.read_text(encoding="utf-8", errors="replace"),
            time.monotonic() - self._begun,
            self.writes(),
        )

    def _be(self) -> None:
        """Be the process: run, and end."""
        code = 70
        # An interrupted command does what is registered for the exit, such as to remove the
        # temporary folders of the process that it is a fork of.
        atexit._clear()  # pyright: ignore[reportAttributeAccessIssue, reportPrivateUsage]
        try:
            out = os.open(self._errors, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(os.open(os.devnull, os.O_RDWR), 0)
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            os.dup2(out, 2)
            os.chdir(self._folder)
            signal.signal(signal.SIGINT, signal.default_int_handler)
            sys.argv = ["pamsim", *self._args]
            sys.addaudithook(self._counted)
            program()
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 1
        except KeyboardInterrupt:  # before the command began
            code = 130
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)

    def _counted(self, event: str, given: tuple[Any, ...]) -> None:
        """Count what is opened for writing, moved, made or removed in the folder."""
        if event == "open":
            if not given[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT):
                return
        elif event not in ("os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.chmod"):
            return
        if not isinstance(given[0], (str, os.PathLike)):
            return
        if os.path.abspath(os.fspath(given[0])).startswith(str(self._folder)):
            number = self.writes() + 1
            self._count[:4] = struct.pack("i", number)
            if number == self._at:
                os.kill(os.getpid(), self._sent)


def emptied(folder: Path, like: Path | None = None) -> Path:
    """The folder, empty or with what another holds."""
    if folder.exists():
        for entry in folder.iterdir():
            shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
    folder.mkdir(exist_ok=True)
    if like is not None:
        shutil.copytree(like, folder, dirs_exist_ok=True)
    return folder


def ended(process: Process) -> Iterator[str]:
    """Wait for the end of a process that may be blocked."""
    if not process.ends_in(LONGEST):
        process.send(signal.SIGKILL)
        yield "did not end"


def whole_run(command: Command, folder: Path, reference: Path) -> Ended:
    """Run a command whole, and copy what it wrote to another folder."""
    Process(command.args, emptied(folder)).wait().check()  # loads what is compiled
    whole = Process(command.args, emptied(folder)).wait().check()
    shutil.copytree(folder, emptied(reference), dirs_exist_ok=True)
    return whole


class Faults:
    """What was wrong, and in which tries of a command.

    Args:
        name: of the command.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.failed = 0
        self.found: dict[str, list[Any]] = {}

    def add(self, found: Iterable[str], when: Any) -> None:
        """What was wrong in a try, if anything."""
        wrong = list(found)
        self.failed += bool(wrong)
        for what in wrong:
            self.found.setdefault(what, []).append(when)

    def row(self) -> dict[str, Any]:
        """Print them; how many tries failed, and some of each fault."""
        for what, when in self.found.items():
            print(f"{self.name}: {len(when)} x {what} (such as {when[0]})", flush=True)
        some = {what: when[:3] for what, when in self.found.items()}
        return {"failed": self.failed, "faults": some}


def again(
    command: Command, folder: Path, reference: Path, code: int, *, parts: bool = False
) -> tuple[bool, list[str]]:
    """Run a command in a folder that a run has left: whether it resumed, and what is wrong."""
    resume = bool(command.checkpoint) and (folder / command.checkpoint).exists()
    options = ("--resume",) if resume else ()
    options += ("--force",) if any(folder.iterdir()) else ()
    process = Process((*command.args, *options), folder)
    found = list(ended(process))
    end = process.wait()
    if end.code != code or end.errors:
        found.append(f"exit code {end.code}: {end.errors.strip()[-200:]!r}")
    found += faults(command, folder, reference, whole=True, parts=parts, resumed=resume)
    return resume, [f"again: {what}" for what in found]


def files(folder: Path) -> dict[str, Path]:
    """Name in the folder -> file, in it and in its folders."""
    found = (path for path in sorted(folder.rglob("*")) if not path.is_dir())
    return {str(path.relative_to(folder)): path for path in found}


def faults(
    command: Command,
    folder: Path,
    reference: Path,
    *,
    whole: bool,
    killed: bool = False,
    parts: bool = False,
    resumed: bool = False,
) -> Iterator[str]:
    """What is wrong with the files of a run.

    Args:
        command: that ran.
        folder: it ran in.
        reference: the same folder after a run that nothing interrupted.
        whole: whether all files must be there, or those that are there be right.
        killed: whether parts of files may have been left.
        parts: whether those beside a folder of results may have been left.
        resumed: whether it went on from a checkpoint.
    """
    near = command.near if resumed else None
    right, there = files(reference), files(folder)
    for name, path in there.items():
        if path.name == LOCK and not whole:
            continue  # the system has freed it
        if path.name.startswith("."):  # a part of a file
            if not killed and not (parts and "/" not in name):
                yield f"{name} was left"
        elif name == command.checkpoint and not whole:
            yield from _fault(path, lambda file: json.loads(file.read_text(encoding="utf-8")))
        elif command.kept and name.startswith(command.kept) and not whole:
            yield from _fault(path, _read_table)
        elif name not in right:
            yield f"{name} is not of the result"
        elif what := _difference(path, right[name], near):
            yield f"{name}: {what}"
        elif path.name == "params.toml" and b"[rig]" in path.read_bytes():
            yield from _fault(path.parent, pamsim.load_rig)
    if whole:
        yield from (f"{name} is missing" for name in right if name not in there)


def _fault(path: Path, read: Callable[[Path], object]) -> Iterator[str]:
    """What is wrong with what a reader makes of a file or folder."""
    try:
        read(path)
    except (OSError, ValueError, pyarrow.ArrowException, PamsimError) as error:
        yield f"{path.name} cannot be read: {error}"


def _read_table(path: Path) -> object:
    return parquet.read_table(path, use_threads=False, page_checksum_verification=True)


def _difference(path: Path, right: Path, near: float | None) -> str:
    """How a file differs; empty if it does not but for durations.

    With a number instead of None a run was resumed: it may have taken other simulations, and have
    numbers that differ by as much.
    """
    taken = _TIMES if near is None else _TIMES | _COUNTS
    got, wanted = path.read_bytes(), right.read_bytes()
    if got == wanted:
        return ""
    if path.suffix == ".json":
        try:
            contents = (json.loads(text) for text in (got, wanted))
            got, wanted = (_without(one, taken) for one in contents)
        except ValueError as error:
            return str(error)
        return _where(got, wanted, near or 0.0)
    if path.suffix == ".html":
        texts = [_DURATION.sub("", text.decode(errors="replace")) for text in (got, wanted)]
        got, wanted = (text if near is None else _COUNT.sub("", text) for text in texts)
        if got == wanted:
            return ""
        pairs = zip(got.splitlines(), wanted.splitlines(), strict=False)
        lines = (f"{a.strip()[:60]!r}, not {b.strip()[:60]!r}" for a, b in pairs if a != b)
        return next(lines, "cut")
    if path.suffix in (".gif", ".mp4"):
        return _film_difference(path, right)
    return f"{len(got)} bytes not those {len(wanted)}"


def _film_difference(path: Path, right: Path) -> str:
    """How a film differs; empty if its frames show the same.

    Drawn twice on a loaded machine, a frame may have some pixels in another colour.
    """
    plugin = "FFMPEG" if path.suffix == ".mp4" else "pillow"
    try:
        got, wanted = (
            iio.imread(film, plugin=plugin, extension=film.suffix).astype(int)
            for film in (path, right)
        )
    except (OSError, ValueError, IndexError, RuntimeError) as error:
        return f"cannot be decoded: {error!r:.80}"
    if got.shape != wanted.shape:
        return f"frames of {got.shape}, not {wanted.shape}"
    other = float(np.mean(np.abs(got - wanted).max(axis=-1) > SAME_COLOUR))
    return "" if other <= OTHER_PIXELS else f"{100.0 * other:.2g} % of the pixels differ"


def _without(content: Any, keys: Set[str]) -> Any:
    if isinstance(content, Mapping):
        return {k: _without(v, keys) for k, v in content.items() if k not in keys}
    return [_without(one, keys) for one in content] if isinstance(content, list) else content


def _where(got: Any, wanted: Any, near: float, at: str = "") -> str:
    """The first place at which two JSON contents differ; empty if none does."""
    if isinstance(got, dict) and isinstance(wanted, dict):
        if got.keys() != wanted.keys():
            return f"{at or 'content'} has other keys: {sorted(got.keys() ^ wanted.keys())}"
        pairs = ((f"{at}.{key}", value, wanted[key]) for key, value in got.items())
    elif isinstance(got, list) and isinstance(wanted, list) and len(got) == len(wanted):
        pairs = ((f"{at}[{i}]", *two) for i, two in enumerate(zip(got, wanted, strict=True)))
    elif got == wanted or (
        isinstance(got, float)
        and isinstance(wanted, float)
        and abs(got - wanted) <= near * max(abs(got), abs(wanted))
    ):
        return ""
    else:
        return f"{at or 'content'} is {got!r:.40}, not {wanted!r:.40}"
    return next((what for key, a, b in pairs if (what := _where(a, b, near, key))), "")


def study(
    script: str,
    description: str | None,
    tries: str,
    most: int,
    row_of: Callable[[str, int, int, Path], dict[str, Any]],
    tried: str,
    *,
    drawn: bool = True,
) -> int:
    """Try every command; print, and write after each.

    Args:
        script: its name.
        description: for ``--help``.
        tries: what is tried, which names the option of their number.
        most: tries of all commands together, if the option is left out.
        row_of: command, tries, seed and folder to its row.
        tried: key of a row with the number of tries made.
        drawn: whether tries are drawn by a seed, and shared out; else each command gets them all.

    Returns:
        Exit code: 1 if one failed.
    """
    asked = parser(description, None, **{tries: most}, **({"seed": 0} if drawn else {}))
    asked.add_argument("--command", nargs="+", choices=COMMANDS, default=list(COMMANDS))
    options = asked.parse_args()
    count, seed = getattr(options, tries), options.seed if drawn else 0
    tqdm.tqdm.monitor_interval = 0  # no thread beside: the process forks
    out = left_out()
    command = f"python scripts/trust/{script} --{tries} {count}" + f" --seed {seed}" * drawn
    before = read(options.json)
    result = {**head(command), "commands": before.get("commands", {}), "left_out": out}
    if before and options.command != list(COMMANDS):
        result["command"] = before["command"]
    here = {name: one.share for name, one in COMMANDS.items() if name not in out}
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder).resolve()
        prepare(root)
        for name in [name for name in options.command if name in here]:
            share = max(1, round(count * here[name] / sum(here.values()))) if drawn else count
            row = row_of(name, share, seed, root)
            if options.command != list(COMMANDS):
                row["command"] = f"{command} --command '{name}'"
            failed += int(row["failed"])
            result["commands"][name] = row
            write(result, options.json)
    done = sum(row[tried] for row in result["commands"].values())
    print(f"{done} {tries} tried, {failed} failed now")
    return int(failed > 0)
