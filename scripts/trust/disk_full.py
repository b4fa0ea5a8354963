"""Whether a full disk loses or spoils anything.

    python scripts/trust/disk_full.py [--points 20] [--seed 0] [--command NAME ...] [--json FILE]

Each command that writes runs once whole, in a small file system in memory, which shows how much it
takes at most. Then it runs with less, at points drawn from nothing to all but one page of 4 KiB.
Afterwards

- the exit code is 2, with one line on stderr that names a file and says that no space is left;
- every file that is there is that of the whole run, durations apart, and none is half;
- with space again, the same command with ``--force``, and ``--resume`` where there is something to
  resume, writes what the whole run wrote: numbers equal to the bit, durations apart.

Needs the right to mount: root, or ``unshare -rm python ...``. FILE is written after each command;
those in it that this call does not run stay. Exits 1 if a point fails.
"""

from __future__ import annotations

import contextlib
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Generator
from pathlib import Path

import numpy as np
import tqdm
import writing_commands as commands
from writing_commands import COMMANDS, Command, Faults, Process

PAGE = 4096
"""Of a file system in memory, which counts whole pages [bytes]."""
_SAYS = re.compile(r"^pamsim: error: .*\w\.\w+: No space left on device$")
PLENTY = 1 << 28
BAD_INPUT = 2


@contextlib.contextmanager
def small_disk(folder: Path) -> Generator[None]:
    """A file system in memory at a folder, for a ``with`` block."""
    folder.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "pamsim", str(folder)], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def resize(folder: Path, size: int) -> None:
    """Give a file system in memory another size [bytes]."""
    subprocess.run(["mount", "-o", f"remount,size={size}", str(folder)], check=True)


def used(folder: Path) -> int:
    """Bytes in use in a file system."""
    return shutil.disk_usage(folder).used


def most(command: Command, folder: Path) -> tuple[int, int]:
    """Run a command whole; its exit code, and the most that it took at any time [bytes]."""
    process, largest = Process(command.args, folder), 0
    while process.runs():
        largest = max(largest, used(folder))
        time.sleep(0.001)
    return process.wait().check().code, max(largest, used(folder))


def tried(
    command: Command, room: int, folder: Path, reference: Path, code: int
) -> tuple[bool, list[str]]:
    """Whether a run found the disk full, and what is wrong after it."""
    resize(commands.emptied(folder), room)
    end = Process(command.args, folder).wait()
    full = end.code != code
    found: list[str] = []
    lines = [line for line in end.errors.splitlines() if line.strip()]
    if full:
        clear = len(lines) == 1 and _SAYS.search(lines[0])
        if end.code != BAD_INPUT or not clear:
            found.append(f"exit code {end.code}: {end.errors.strip()[-200:]!r}")
    found += [
        f"full: {what}" for what in commands.faults(command, folder, reference, whole=not full)
    ]
    resize(folder, PLENTY)
    return full, found + commands.again(command, folder, reference, code)[1]


def points_of(name: str, points: int, seed: int, root: Path) -> dict[str, object]:
    """Run a command whole, then with less room, and count."""
    command = COMMANDS[name]
    folder, reference = root / "disk", root / "reference"
    rng = np.random.default_rng([seed, list(COMMANDS).index(name)])
    wrong, rooms, fulls = Faults(name), [], 0
    with small_disk(folder):
        resize(folder, PLENTY)
        Process(command.args, folder).wait().check()  # loads what is compiled
        code, largest = most(command, commands.emptied(folder))
        shutil.copytree(folder, commands.emptied(reference), dirs_exist_ok=True)
        # One in each of as many equal parts: spread, and nowhere the same.
        parts = (np.arange(points) + rng.uniform(size=points)) / points
        for part in tqdm.tqdm(parts, desc=name, unit="point"):
            rooms.append(PAGE * max(1, int(part * largest / PAGE)))
            full, found = tried(command, rooms[-1], folder, reference, code)
            fulls += full
            wrong.add(found, f"with {rooms[-1]} bytes")
    return {
        "args": command.line,
        "bytes": largest,
        "points": points,
        "rooms": rooms,
        "full": fulls,
        **wrong.row(),
    }


if __name__ == "__main__":
    sys.exit(commands.study("disk_full.py", __doc__, "points", 20, points_of, "full"))
