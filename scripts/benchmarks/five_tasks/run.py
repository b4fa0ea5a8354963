"""Five tasks with pamsim beside the nearest public tools: lines, processor seconds, answers.

    python scripts/benchmarks/five_tasks/run.py [--json FILE]

Needs pamsim with ``[rl]`` and python-control. The peers' sides are the ``plain_*.py`` beside
this file, as short as a user would write them; the last three build on ``plain_arm.py``, so its
lines count there, too. A side of pamsim is one command. The data of tasks 2 to 4 are pamsim's own
simulations, so that the true answer is known; a public tool has to model the same arm first.
Seconds are of the processor, on one thread, imports included and with compiled code in its cache.
"""

from __future__ import annotations

import ast
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
from timing import finish, parser

HERE = Path(__file__).resolve().parent
ARM = "plain_arm.py"
STEPS = "5000"  # of training, on both sides: enough to time it, not for a good policy


def lines(*names: str) -> int:
    """Lines of scripts that are neither blank nor the docstring."""
    total = 0
    for name in names:
        text = (HERE / name).read_text(encoding="utf-8")
        docstring = ast.parse(text).body[0].end_lineno or 0
        total += sum(bool(line.strip()) for line in text.splitlines()[docstring:])
    return total


def timed(folder: Path, *command: str) -> tuple[str, float]:
    """What a Python command prints, and its processor time [s]."""
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, *command], cwd=folder, env=environment, capture_output=True, text=True
    )
    if done.returncode not in (0, 1):
        sys.exit(f"{' '.join(command)} failed:\n{done.stderr}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"{seconds:7.1f} s  {' '.join(command)}", flush=True)
    return done.stdout, seconds


def pamsim_side(folder: Path, line: str) -> dict[str, Any]:
    """One command of pamsim."""
    text, seconds = timed(folder, "-m", "pamsim", *line.split())
    return {"command": f"pamsim {line}", "cpu_s": seconds, "printed": text.strip()}


def plain_side(folder: Path, tools: str, scripts: tuple[str, ...], *given: str) -> dict[str, Any]:
    """A script of the peer's, the first, with those that it builds on."""
    text, seconds = timed(folder, str(HERE / scripts[0]), *given)
    return {
        "tools": tools,
        "scripts": list(scripts),
        "lines": lines(*scripts),
        "cpu_s": seconds,
        "printed": text.strip(),
    }


def measured(folder: Path) -> dict[str, Any]:
    """Both sides of every task."""
    fitted = "identify data --order 2 --dead-time none"
    for line in (  # of each kind of command the first compiles
        "step --pressure 100,0 --duration 100ms",
        "step --pressure 400,0 --start 400,400 --load 1.2kg --duration 4 --out data",
        fitted,
        "train --out first.npz --steps 64",
    ):
        pamsim_side(folder, line)
    diagnosed = pamsim_side(folder, "demo --no-open --out demo")
    step = str(folder / "data" / "step.csv")
    trials = [str(folder / "demo" / "recording" / f"triangle_{n}.csv") for n in ("1", "check_1")]
    tasks = (
        ("simulate", "step --pressure 487,0 --load 1.2kg", "MuJoCo", (ARM,), ()),
        ("identify", fitted, "scipy, python-control", ("plain_identify.py",), (step,)),
        ("calibrate", "calibrate data --free joint.shaft.damping", "MuJoCo, scipy",
         ("plain_calibrate.py", ARM), (step,)),
        ("diagnose", "", "MuJoCo, scipy, matplotlib", ("plain_diagnose.py", ARM), trials),
        ("train", f"train --out policy.npz --steps {STEPS}",
         "MuJoCo, gymnasium, stable-baselines3", ("plain_train.py", ARM), (STEPS,)),
    )  # fmt: skip
    return {
        name: {
            "pamsim": pamsim_side(folder, line) if line else diagnosed,
            "peer": plain_side(folder, tools, scripts, *given),
        }
        for name, line, tools, scripts, given in tasks
    }


def main() -> None:
    """Run both sides of the five tasks, and write the record."""
    target = parser(__doc__, HERE.parent / "results" / "five_tasks.json").parse_args().json
    with tempfile.TemporaryDirectory() as folder:
        tasks = measured(Path(folder))
    packages = ("scipy", "control", "gymnasium", "stable-baselines3", "torch")
    finish("five_tasks/run.py", {"tasks": tasks}, target, *packages)


if __name__ == "__main__":
    main()
