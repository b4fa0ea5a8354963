"""Whether broken input is refused in one line, quickly, or read; nothing else.

    python scripts/trust/readers.py [--grammar] [--runs 1000] [--subprocesses 0] [--reader NAME]
        [--seed 0] [--json FILE]

Each run spoils a good file (bytes turned, cut, doubled, moved; numbers too long, too large, not a
number; nesting too deep; NUL, surrogates, formulas) and reads it: a rig's ``params.toml`` and its
MJCF, ``recording.toml``, a CSV of a recording, measured tables, quantities with units, a saved
policy, a checkpoint. With ``--grammar`` the files are drawn from the grammar of their format
instead (`grammars`), well-formed and meaningless. Allowed are a result and an `InputError` or
`EngineError` of one line. A run fails by another exception, by a message of several lines or of
more than 1,000 characters, by 1 s of processor time, by more than 1 GiB of memory, or by the end of
the process. With ``--subprocesses`` the command line reads as many such files as well, each in a
process of its own: allowed are exit codes 0, 1 and 2, no traceback, and for 2 one line of at most
1,000 characters; time and memory are those beyond what the good file takes. FILE is written after
each reader; those in it that this call does not run stay. Exits 1 if a run fails.
"""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path

import grammars
import numpy as np
import pyarrow
import scipy.io
from pyarrow import parquet
from tqdm import tqdm

import pamsim
from pamsim.controllers.neural_policy import read_policy
from pamsim.core.encoding import CheckpointFile
from pamsim.core.errors import PamsimError
from pamsim.core.units import parse_quantity
from pamsim.identification.plain_table import plain_trials
from pamsim.identification.records import SignalRecord
from pamsim.identification.signals import chosen_signals
from pamsim.recordings.measured_table import read_measured
from pamsim.recordings.recording import write_recording
from pamsim.recordings.rig_file import shipped_rigs
from pamsim.recordings.table_reader import read_columns

sys.path.insert(0, str(Path(__file__).parents[1]))
from records import head, parser, read, write

SECONDS, BYTES = 1.0, 1 << 30
BATCH = 50
LONGER = "more than 1 s longer"
REFUSED = 2
"""Exit code of bad input."""

NASTY = (
    b"\x00", b"\xff\xfe", b"\xed\xa0\x80", b"9" * 5000, b"1e999", b"-1e-999", b"nan", b"inf", b"-0",
    b"[" * 3000, b"{" * 3000, b"(" * 3000, b"\"", b"'''", b"\n\n", b"\r", b"\t", b",,,,", b";",
    b"m**9**9**9**9", b"kPa^99999999", b"1/0", b"$\\bad{x$", b"p1000000000_kpa",
    b"<replicate count=\"3000000\">", b"&lol;", b"../../../../etc/passwd", b"a" * 100_000,
    b"true", b"1979-05-27T07:32:00", b"0x", b"1_0", "\u202e\U0001f4a5".encode(), b"=", b"#",
)  # fmt: skip
"""Put into a file, or in the place of a number in it."""


def spoilt(good: bytes, rng: np.random.Generator) -> bytes:
    """A file with one to four faults."""
    text = bytearray(good)
    for _ in range(int(rng.integers(1, 5))):
        size = len(text)
        at, end = sorted(int(i) for i in rng.integers(0, size + 1, 2))
        end = min(end, at + int(rng.integers(1, 200)))
        match int(rng.integers(6)):
            case 0 if size:
                text[at % size] = int(rng.integers(256))
            case 1:
                del text[at:end]
            case 2:
                text[at:at] = text[at:end] * int(rng.integers(1, 4))
            case 3:
                text[at:at] = NASTY[int(rng.integers(len(NASTY)))]
            case 4:  # in the place of a number or a word
                while at < size and not (chr(text[at]).isalnum()):
                    at += 1
                end = at
                while end < size and chr(text[end]).isalnum():
                    end += 1
                text[at:end] = NASTY[int(rng.integers(len(NASTY)))]
            case _:
                del text[at:]
    return bytes(text)


@dataclass(frozen=True)
class Reader:
    """What is read.

    Attributes:
        make: writes good files into a folder; returns the one to spoil.
        read: reads it, from that folder.
        grammar: draws one.
        command: arguments of ``pamsim`` that read it; None if no command does.
    """

    make: Callable[[Path], Path]
    read: Callable[[Path], object]
    grammar: Callable[[np.random.Generator], bytes]
    command: Callable[[Path], list[str]] | None = None

    def bad(self, good: bytes, seed: int, run: int, *, drawn: bool) -> bytes:
        """Content of a run: drawn from the grammar, or a good one with faults."""
        rng = np.random.default_rng([seed, run])
        return self.grammar(rng) if drawn else spoilt(good, rng)


def _rig(folder: Path) -> Path:
    shutil.copytree(shipped_rigs() / "mas20_arm", folder, dirs_exist_ok=True)
    return folder / "params.toml"


def _mjcf(folder: Path) -> Path:
    _rig(folder)
    return folder / "mas20_arm.xml"


def _recording(folder: Path) -> Path:
    rig = pamsim.load_rig("mas20_arm")
    run = pamsim.simulate(rig, pamsim.pressure_step((3e5, 3e5), (3e5, 2e5), duration=0.1))
    write_recording(folder, "mas20_arm", {"step": run})
    return folder / "recording.toml"


def _csv(folder: Path) -> Path:
    return next(path for path in _recording(folder).parent.iterdir() if path.suffix == ".csv")


def _table(folder: Path) -> Path:
    path = folder / "map.csv"
    rows = [f"{p},{k},{p * (0.3 - k):.3f}" for p in (100, 200, 300) for k in (0.0, 0.05, 0.1, 0.15)]
    path.write_text("\n".join(["p_kpa,contraction,force_n", *rows]), encoding="utf-8")
    return path


def _text(content: str) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        path = folder / "text"
        path.write_text(content, encoding="utf-8")
        return path

    return make


def _policy(folder: Path) -> Path:
    path = folder / "policy.npz"
    shutil.copyfile(grammars.POLICY, path)
    return path


def _arrays(ending: str) -> Callable[[Path], Path]:
    """A log of arrays."""

    def make(folder: Path) -> Path:
        path = folder / f"log{ending}"
        table = {"t": np.arange(50) * 0.01, "p": np.linspace(1e5, 2e5, 50)}
        if ending == ".npz":
            np.savez(path, **table)
        elif ending == ".mat":
            scipy.io.savemat(path, table)
        else:
            parquet.write_table(pyarrow.table(table), path)
        return path

    return make


def _records(path: Path) -> list[SignalRecord]:
    """Records of u and y in a table of any columns."""
    tables, _ = plain_trials(read_columns(path))
    chosen_signals(tables, ("u",), "y")  # refused if one is no column of numbers
    return [SignalRecord(t.name, t.time, t.columns["u"], t.columns["y"]) for t in tables]


def _rig_command(path: Path) -> list[str]:
    return ["list", "effects", "--rig", str(path.parent)]


def _recording_command(path: Path) -> list[str]:
    return ["identify", str(path.parent), "--order", "1", "--no-local"]


def _import_command(path: Path) -> list[str]:
    columns = [f"--column=muscle_{i}.pressure=p:Pa" for i in (1, 2)]
    out = str(path.parent / "out")
    return ["import", str(path), "--rig", "mas20_arm", "--out", out, "--force", *columns]


READERS = {
    "params.toml": Reader(
        _rig, lambda path: pamsim.load_rig(path.parent), grammars.params, _rig_command
    ),
    "MJCF": Reader(_mjcf, lambda path: pamsim.load_rig(path.parent), grammars.mjcf, _rig_command),
    "recording.toml": Reader(
        _recording, pamsim.read_recordings, grammars.recording, _recording_command
    ),
    "CSV of a recording": Reader(
        _csv, lambda path: pamsim.read_recordings(path.parent), grammars.log, _recording_command
    ),
    "measured table": Reader(
        _table,
        lambda path: read_measured(path, 0.3),
        grammars.force_map,
        lambda path: ["fit", str(path), "--model", "six_parameter", "--nominal-length", "0.3m"],
    ),
    "plain table": Reader(
        _text("t,u,y\n" + "".join(f"{k / 100},{k // 20 % 2},{k % 40}\n" for k in range(200))),
        _records,
        grammars.signals,
        lambda path: ["identify", str(path), "--input=u", "--output=y", "--order=1", "--no-local"],
    ),
    "quantity": Reader(
        _text("4.87 bar"),
        lambda path: parse_quantity(
            path.read_bytes().decode("utf-8", "surrogateescape"), "kPa", "Pa", where="--pressure"
        ),
        grammars.quantity,
    ),
    ".npz log": Reader(_arrays(".npz"), read_columns, grammars.npz, _import_command),
    ".mat log": Reader(_arrays(".mat"), read_columns, grammars.mat, _import_command),
    ".parquet log": Reader(
        _arrays(".parquet"), read_columns, grammars.parquet_table, _import_command
    ),
    "checkpoint": Reader(
        _text('{"settings": "ab", "fits": {"a": {"values": {"b": 1.0}}}}'),
        lambda path: CheckpointFile(path).load(),
        grammars.checkpoint,
    ),
    "policy": Reader(_policy, read_policy, grammars.policy),
}


def fault(reader: Reader, path: Path) -> str:
    """What is wrong with how a reader answers to a file; empty if nothing is."""
    try:
        reader.read(path)
    except PamsimError as error:
        text = str(error)
        if "\n" in text:
            return f"several lines: {text[:80]!r}"
        return "" if len(text) <= 1000 else "more than 1,000 characters"
    except _TooLongError:
        return "more than 1 s"
    except MemoryError:
        return "more than 1 GiB"
    except BaseException as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {str(error)[:80]!r} at {Path(frame.filename).name}"
    return ""


class _TooLongError(Exception):
    pass


def _too_long(number: int, frame: object) -> None:
    raise _TooLongError


def batch(name: str, drawn: bool, seed: int, first: int, count: int) -> list[tuple[int, str]]:
    """Faults of some runs, by their numbers; in a process of its own."""
    reader = READERS[name]
    found: list[tuple[int, str]] = []
    signal.signal(signal.SIGVTALRM, _too_long)
    resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    with tempfile.TemporaryDirectory() as folder:
        path = reader.make(Path(folder))
        good = path.read_bytes()
        reader.read(path)  # loads what is needed once
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + BYTES, resource.RLIM_INFINITY))
        for run in range(first, first + count):
            path.write_bytes(reader.bad(good, seed, run, drawn=drawn))
            signal.setitimer(signal.ITIMER_VIRTUAL, SECONDS)
            try:  # the time may be up while the clock is stopped
                try:
                    what = fault(reader, path)
                finally:
                    signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
            except _TooLongError:
                what = "more than 1 s"
            if what:
                found.append((run, what))
    return found


def subprocess_faults(
    reader: Reader, drawn: bool, seed: int, runs: int, name: str
) -> dict[str, list[int]]:
    """Faults of the command line, each run in a process of its own."""
    if reader.command is None or runs == 0:
        return {}
    found: dict[str, list[int]] = {}
    with tempfile.TemporaryDirectory() as folder:
        path = reader.make(Path(folder))
        good = path.read_bytes()
        command = reader.command(path)
        usual = max((_called(command) for _ in range(3)), key=lambda one: one.seconds)
        if usual.code not in (0, 1) or usual.text:
            raise ValueError(f"pamsim {' '.join(command)} fails with the good file: {usual.text}")
        for run in tqdm(range(runs), desc=f"{name}, command line", unit="run"):
            path.write_bytes(reader.bad(good, seed, run, drawn=drawn))
            what = _command_fault(_called(command), usual)
            if what == LONGER:  # once more: another program may have taken the processor
                what = _command_fault(_called(command), usual)
            if what:
                found.setdefault(what, []).append(run)
    return found


@dataclass(frozen=True)
class Called:
    """How a command ended: exit code, stderr, processor time [s], most memory [bytes]."""

    code: int
    text: str
    seconds: float
    memory: int


def _called(command: list[str]) -> Called:
    """Call ``pamsim``."""
    with tempfile.TemporaryFile() as stderr:
        process = subprocess.Popen(
            [sys.executable, "-m", "pamsim", *command],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=stderr,
        )
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        stderr.seek(0)
        text = stderr.read().decode("utf-8", "replace")
    return Called(process.returncode, text, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024)


def _command_fault(found: Called, usual: Called) -> str:
    """What is wrong with how a command ended; empty if nothing is."""
    lines = [line for line in found.text.splitlines() if line.strip()]
    if found.code not in (0, 1, REFUSED) or "Traceback" in found.text:
        return f"exit code {found.code}: {lines[-1][:80] if lines else ''}"
    if found.code == REFUSED and len(lines) != 1:
        return f"{len(lines)} lines: {lines[:1]}"
    if found.code == REFUSED and len(lines[0]) > 1000:
        return "more than 1,000 characters"
    if found.seconds > usual.seconds + SECONDS:
        return LONGER
    return "more than 1 GiB more" if found.memory > usual.memory + BYTES else ""


def main() -> None:
    """Run, print, write."""
    asked = parser(__doc__, runs=1000, subprocesses=0, seed=0)
    asked.add_argument("--reader", choices=READERS)
    asked.add_argument("--grammar", action="store_true", help="draw files from their grammar")
    options = asked.parse_args()
    result = head("python scripts/trust/readers.py [--grammar] --runs N --subprocesses M --seed S")
    result["readers"] = read(options.json).get("readers", {})
    failed = 0
    for name in READERS if options.reader is None else (options.reader,):
        faults: dict[str, list[int]] = {}
        for first in tqdm(range(0, options.runs, BATCH), desc=name, unit="batch"):
            count = min(BATCH, options.runs - first)
            for run, what in _in_a_process(name, options.grammar, options.seed, first, count):
                faults.setdefault(what, []).append(run)
        called = subprocess_faults(
            READERS[name], options.grammar, options.seed, options.subprocesses, name
        )
        for what, runs in (*faults.items(), *called.items()):
            print(f"{name}: {len(runs)} x {what} (such as run {runs[0]})")
        commands = 0 if READERS[name].command is None else options.subprocesses
        own = {"seed": options.seed, **_counted("runs", options.runs, faults)}
        own |= _counted("subprocesses", commands, called)
        failed += sum(map(len, (*faults.values(), *called.values())))
        result["readers"].setdefault(name, {})["drawn" if options.grammar else "spoilt"] = own
        write(result, options.json)
    print(f"{failed} failed")
    sys.exit(int(failed > 0))


def _counted(kind: str, runs: int, faults: Mapping[str, list[int]]) -> dict[str, object]:
    """Number of runs and of failed ones, and some of each fault."""
    return {
        kind: runs,
        f"{kind}_failed": sum(map(len, faults.values())),
        f"{kind}_faults": {what: found[:5] for what, found in faults.items()},
    }


_pool: list[ProcessPoolExecutor] = []


def _in_a_process(
    name: str, drawn: bool, seed: int, first: int, count: int
) -> list[tuple[int, str]]:
    """Runs of one batch; where the process ends in them, one by one to find out which."""
    if not _pool:
        _pool.append(ProcessPoolExecutor(1))
    try:
        return _pool[0].submit(batch, name, drawn, seed, first, count).result()
    except BrokenProcessPool:
        _pool.clear()
        if count == 1:
            return [(first, "the process ended")]
        half = count // 2
        return [
            *_in_a_process(name, drawn, seed, first, half),
            *_in_a_process(name, drawn, seed, first + half, count - half),
        ]


if __name__ == "__main__":
    main()
