"""Whether a command can be interrupted at any moment of its start, imports included.

    python scripts/trust/interrupts.py [--moments 100] [--command NAME ...] [--json FILE]

Each command that writes is a process of its own, as typed, and gets SIGINT or SIGTERM at every 20
ms of its first 2 s, every other time over the files of an earlier run. Allowed are exit code 130
and the command's own if it was through, with at most one line on stderr. Until pamsim's handlers
are set the interpreter answers itself: it dies of the signal, for SIGINT with a traceback of its
own imports, or goes on; the last moment at which it did is in the record. A run fails by another
code, by more lines, by not ending in 10 s, or by its files: each must be that of the whole run,
with no hidden part beside it. FILE is written after each command; those in it that this call does
not run stay. Exits 1 if a run fails.
"""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import tqdm
from writing_commands import COMMANDS, Command, Faults, emptied, faults, study, whole_run

INTERRUPTED, INTERPRETER = 130, 1
"""Exit codes: of an interrupted command, of an interpreter interrupted in its own start."""
PROGRAM = "cli/main.py"
"""In a traceback, once pamsim's handlers are set."""
RESUMED = "nothing is lost: go on with"
"""In the line that a command with a checkpoint prints before."""
SITE = "Remainder of file ignored"
"""On stderr, if Python's own start has swallowed the signal and goes on."""
EVERY = 0.02
"""Between two moments [s]."""
ENDS = 10.0
"""Time for an interrupted command to end [s]."""
SIGNALS = (signal.SIGINT, signal.SIGTERM)
PAMSIM = [sys.executable, "-m", "pamsim"]


def interrupted(
    args: tuple[str, ...], folder: Path, sent: signal.Signals, after: float
) -> tuple[int | None, str]:
    """Exit code, None if it does not end, and stderr of a process that got a signal."""
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(
            [*PAMSIM, *args],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=errors,
        )
        time.sleep(after)
        process.send_signal(sent)
        try:
            code = process.wait(ENDS)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            code = None
        errors.seek(0)
        return code, errors.read().decode("utf-8", "replace")


def faults_of(
    command: Command,
    folder: Path,
    reference: Path,
    own: int,
    sent: signal.Signals,
    moment: int,
    count: Counter[str],
) -> list[str]:
    """What is wrong after a signal; counts how the runs ended."""
    over = moment % 2 == 1
    emptied(folder, reference if over else None)
    args = (*command.args, "--force") if over else command.args
    code, errors = interrupted(args, folder, sent, EVERY * moment)
    lines = [line for line in errors.splitlines() if line.strip() and RESUMED not in line]
    if SITE in errors or (code in (-sent, INTERPRETER) and PROGRAM not in errors):
        count["interpreter"] += 1
        count["interpreter_until_ms"] = max(count["interpreter_until_ms"], _milliseconds(moment))
        return []
    # With --force a checkpoint begins again at once.
    kept = over and not command.checkpoint
    found = list(faults(command, folder, reference, whole=kept or code == own))
    if code is None:
        found.append(f"did not end in {ENDS:g} s")
    elif code not in (own, INTERRUPTED):
        found.append(f"exit code {code}")
    if len(lines) > 1 or "Traceback" in errors:
        found.append(f"{len(lines)} lines: {lines[-1][:80]!r}")
    count["through" if code == own else "interrupted"] += 1
    return found


def _milliseconds(moment: int) -> int:
    return round(1e3 * EVERY * moment)


def row_of(name: str, moments: int, _seed: int, root: Path) -> dict[str, object]:
    """Run a command whole, then interrupt it at every moment."""
    command = COMMANDS[name]
    folder, reference = root / "interrupted", root / "reference"
    own = whole_run(command, folder, reference).code
    count = Counter(interpreter=0, interrupted=0, through=0, interpreter_until_ms=0)
    wrong, every = Faults(name), list(itertools.product(SIGNALS, range(moments)))
    for sent, moment in tqdm.tqdm(every, desc=name, unit="signal"):
        found = faults_of(command, folder, reference, own, sent, moment, count)
        wrong.add(found, f"{sent.name} after {_milliseconds(moment)} ms")
    return {"args": command.line, "signals": len(every), **count, **wrong.row()}


if __name__ == "__main__":
    os.environ["MPLBACKEND"] = "agg"
    # A study in the background ignores SIGINT, and so would what it starts.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.exit(study("interrupts.py", __doc__, "moments", 100, row_of, "signals", drawn=False))
