"""Whether a run that is killed loses or spoils anything.

    python scripts/trust/kills.py [--kills 200] [--seed 0] [--command NAME ...] [--json FILE]

Each command that writes runs once whole; then it is killed again and again, by SIGKILL, SIGTERM or
SIGINT, half of the times at a random moment of its run, half of them at a random event of writing
(a file opened for writing, moved, removed, a folder made) or up to 20 ms after it, and a third of
the times over the files of an earlier run. Afterwards

- every file is that of the whole run, durations apart; a checkpoint can be read, a rig loaded;
  SIGKILL may leave hidden parts of files, SIGTERM and SIGINT none;
- SIGTERM and SIGINT end with exit code 130 and without a traceback;
- the same command with ``--force``, and ``--resume`` where there is something to resume, writes
  what the whole run wrote: numbers equal to the bit, durations apart, and films with the same
  frames; no hidden part stays in its folder of results.

A moment after the end of the run counts for nothing and is drawn again. FILE is written after each
command; those in it that this call does not run stay. Exits 1 if a kill fails.
"""

from __future__ import annotations

import signal
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tqdm
import writing_commands as commands
from writing_commands import COMMANDS, Command, Faults, Process

INTERRUPTED = 130


@dataclass(frozen=True, kw_only=True)
class Kill:
    """When a run is killed, and how.

    Attributes:
        signal: that it gets.
        over: whether an earlier run has left its files in the folder.
        write: event of writing that is waited for; 0 for the start.
        seconds: after it [s].
    """

    signal: signal.Signals
    over: bool
    write: int
    seconds: float

    def __str__(self) -> str:
        after = f"write {self.write}" if self.write else "the start"
        over = ", over an earlier run" if self.over else ""
        return f"{self.signal.name} {1e3 * self.seconds:.0f} ms after {after}{over}"


def drawn(rng: np.random.Generator, seconds: float, writes: int) -> Kill:
    """A kill of a run that takes some seconds and writes so many times."""
    signals = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
    sent = signals[rng.choice(3, p=(0.6, 0.2, 0.2))]
    over = bool(rng.random() < 1 / 3)
    if rng.random() < 0.5:
        return Kill(signal=sent, over=over, write=0, seconds=float(rng.uniform(0.0, seconds)))
    at = int(rng.integers(1, writes + 1))
    wait = 0.0 if rng.random() < 0.5 else float(rng.uniform(0.0, 0.02))
    return Kill(signal=sent, over=over, write=at, seconds=wait)


def hit(process: Process, kill: Kill) -> bool:
    """Kill a process at its moment; False if it ended before."""
    while kill.write and process.writes() < kill.write and process.runs():
        time.sleep(0.0005)
    if process.ends_in(kill.seconds):
        return False
    process.send(kill.signal)
    return True


def tried(
    command: Command, kill: Kill, folder: Path, reference: Path, code: int, count: Counter[str]
) -> list[str]:
    """What is wrong after a kill; counts ``kills``, ``missed`` and ``resumed``."""
    commands.emptied(folder, reference if kill.over else None)
    args = (*command.args, "--force") if kill.over else command.args
    at_once = kill.write if kill.seconds == 0.0 else 0
    process = Process(args, folder, at=at_once, sent=kill.signal)
    reached = hit(process, kill) if not at_once else True
    found = list(commands.ended(process))
    end = process.wait()
    if not reached or (at_once and end.writes < at_once):
        count["missed"] += 1
        return []
    count["kills"] += 1
    killed = kill.signal == signal.SIGKILL or end.code == -kill.signal
    allowed = {code, -kill.signal} if killed else {code, INTERRUPTED}
    if end.code not in allowed or "Traceback" in end.errors:
        found.append(f"exit code {end.code}: {end.errors.strip()[-200:]!r}")
    done = end.code == code and not kill.over
    found += [f"after the kill: {what}" for what in commands.faults(
        command, folder, reference, whole=done, killed=killed
    )]  # fmt: skip
    resumed, wrong = commands.again(command, folder, reference, code, parts=killed)
    count["resumed"] += resumed
    return found + wrong


def kills_of(name: str, kills: int, seed: int, root: Path) -> dict[str, object]:
    """Run a command whole, kill it, and count."""
    command = COMMANDS[name]
    folder, reference = root / name.replace(" ", "_"), root / "reference"
    whole = commands.whole_run(command, folder, reference)
    rng = np.random.default_rng([seed, list(COMMANDS).index(name)])
    wrong = Faults(name)
    count, kinds = Counter[str](), Counter[str]()
    with tqdm.tqdm(total=kills, desc=name, unit="kill") as bar:
        while count["kills"] < kills:
            kill, before = drawn(rng, whole.seconds, whole.writes), count["kills"]
            found = tried(command, kill, folder, reference, whole.code, count)
            if count["kills"] == before:
                continue
            bar.update()
            kinds[kill.signal.name] += 1
            kinds["while writing"] += kill.write > 0
            kinds["over an earlier run"] += kill.over
            wrong.add(found, str(kill))
    return {
        "args": command.line,
        "seconds": round(whole.seconds, 1),
        "writes": whole.writes,
        "kills": count["kills"],
        **kinds,
        "resumed": count["resumed"],
        "missed": count["missed"],
        **wrong.row(),
    }


if __name__ == "__main__":
    sys.exit(commands.study("kills.py", __doc__, "kills", 200, kills_of, "kills"))
