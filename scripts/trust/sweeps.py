"""Does a sweep lose or repeat anything when it is killed, and what does it cost?

    python scripts/trust/sweeps.py [--runs 10000] [--duration 2] [--json FILE]

One study of the MAS-20 arm (steps of ``--duration`` seconds; Sobol' draws of load, dead volume and
Coulomb friction) is run in these ways, each in processes of its own:

- undisturbed: the largest memory it had;
- the same with a quarter of the runs, for the growth of the memory;
- killed (SIGKILL) at a third and at two thirds of its blocks, and resumed: is the table equal, were
  finished blocks run again?
- ``cost``: processor time of a sweep of 1,500 runs over that of the bare batch in it, the calls of
  `simulate_batch`, twice; ``--cost`` measures this alone;
- on a Dask cluster of two worker processes over TCP, one of which is killed half-way: is it equal?
  Left out where the package ``distributed`` is not installed.
"""

from __future__ import annotations

import importlib.util
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from pyarrow import parquet

from pamsim.core.computation import versions
from pamsim.sweeps.run_table import CHUNKS, FILE
from pamsim.sweeps.simulated import BLOCK

sys.path.insert(0, str(Path(__file__).parents[1]))
from records import parser, print_and_write, read

COST_RUNS = 1500

STUDY = """schema = "pamsim-sweep/1"
design = "sobol"
runs = {runs}
seed = 3

[experiment]
start_pressure = [300, 300]
final = [300, 100]
duration = {duration}

[vary.load]
low = 0
high = 2

[vary."chamber.dead_volume"]
distribution = "norm"
loc = 10
scale = 0.5

[vary.coulomb_friction]
low = 0
high = 1
"""

SWEEP = """
import sys, time
from pamsim.sweeps import simulated
from pamsim.sweeps.study import read_study
from pamsim.sweeps.sweep import sweep
plan = read_study(sys.argv[1])
plan.job.rows(plan.runs[:2], None)
bare, inside = simulated.simulate_batch, [0.0]

def timed(*args, **options):
    began = time.process_time()
    found = bare(*args, **options)
    inside[0] += time.process_time() - began
    return found

simulated.simulate_batch = timed
began = time.process_time()
sweep(plan, out=sys.argv[2])
print((time.process_time() - began) / inside[0])
"""
"""Run a study and print its processor time over that of the bare batch in it."""

CLUSTER = """
import sys, threading, time
from pathlib import Path
from distributed import LocalCluster
from pamsim.sweeps.run_table import CHUNKS
from pamsim.sweeps.sweep import sweep

if __name__ == "__main__":
    out, blocks = Path(sys.argv[2]), int(sys.argv[3])
    with LocalCluster(n_workers=2, threads_per_worker=1, protocol="tcp",
                      dashboard_address=None) as c:
        def kill():
            while len(list((out / CHUNKS).glob("*.parquet"))) < blocks // 2:
                time.sleep(0.01)
            worker = list(c.workers.values())[0]
            worker.process.process._process.kill()
        threading.Thread(target=kill, daemon=True).start()
        with c.get_client() as client:
            sweep(sys.argv[1], out=out, executor=client.get_executor())
"""


def child(code: str, *words: str | Path) -> tuple[str, float]:
    """What a program prints, and the most memory that any program here has had so far [MB]."""
    done = subprocess.run(
        [sys.executable, "-c", code, *words], check=True, capture_output=True, text=True
    )
    return done.stdout, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024.0


def killed_and_resumed(study: Path, out: Path, blocks: int) -> int:
    """Kill a sweep twice and let it end; the number of blocks that were written twice."""
    command = [sys.executable, "-m", "pamsim", "sweep", study, "--out", out]
    seen: dict[str, int] = {}
    again = 0
    for share in (1 / 3, 2 / 3, None):
        more = ["--resume"] if share != 1 / 3 else []
        process = subprocess.Popen([*command, *more], stdout=subprocess.DEVNULL)
        while process.poll() is None:
            for path in (out / CHUNKS).glob("*.parquet"):
                try:
                    inode = path.stat().st_ino
                except FileNotFoundError:  # made into one table meanwhile
                    continue
                again += seen.setdefault(path.name, inode) != inode
                seen[path.name] = inode
            if share is not None and len(seen) >= share * blocks:
                process.send_signal(signal.SIGKILL)
            time.sleep(0.005)
        process.wait()
    return again


def cost_over_batch(duration: float) -> dict[str, Any]:
    """Processor time of sweeps over that of the bare batch in them."""
    with tempfile.TemporaryDirectory() as temporary:
        study = Path(temporary) / "study.toml"
        study.write_text(STUDY.format(runs=COST_RUNS, duration=duration), encoding="utf-8")
        ratios = [
            round(float(child(SWEEP, study, Path(temporary) / f"out_{number}")[0].split()[-1]), 3)
            for number in range(2)
        ]
    return {"runs": COST_RUNS, "sweep_over_batch": ratios}


def main() -> None:
    """Run all, compare, write."""
    asked = parser(__doc__, runs=10_000, duration=2.0)
    asked.add_argument("--cost", action="store_true")
    options = asked.parse_args()
    if options.cost:
        cost = {"cost": cost_over_batch(options.duration)}
        print_and_write(read(options.json) | cost, options.json)
        return
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        study, quarter = folder / "study.toml", folder / "quarter.toml"
        for path, runs in ((study, options.runs), (quarter, options.runs // 4)):
            text = STUDY.format(runs=runs, duration=options.duration)
            path.write_text(text, encoding="utf-8")
        blocks = -(-options.runs // BLOCK)
        _, memory_quarter = child(SWEEP, quarter, folder / "quarter")
        _, memory = child(SWEEP, study, folder / "whole")
        whole = parquet.read_table(folder / "whole" / FILE)
        again = killed_and_resumed(study, folder / "killed", blocks)
        result: dict[str, Any] = {
            "command": f"python scripts/trust/sweeps.py --runs {options.runs}"
            f" --duration {options.duration:g}",
            "versions": versions(),
            "processors": os.cpu_count(),
            "runs": options.runs,
            "blocks": blocks,
            "memory_mb_quarter_of_the_runs": round(memory_quarter, 1),
            "memory_mb": round(memory, 1),
            "killed_twice_equal": parquet.read_table(folder / "killed" / FILE).equals(whole),
            "blocks_run_again": again,
            "cost": cost_over_batch(options.duration),
        }
        if importlib.util.find_spec("distributed") is not None:
            script = folder / "cluster.py"
            script.write_text(CLUSTER, encoding="utf-8")
            words = [sys.executable, script, study, folder / "dask", str(blocks)]
            subprocess.run(words, check=True, capture_output=True)
            lost = parquet.read_table(folder / "dask" / FILE)
            result["dask_worker_killed_equal"] = lost.equals(whole)
    print_and_write(result, options.json)


if __name__ == "__main__":
    main()
