"""What compiling costs: the first command of an installation, later ones, and all laws at once.

    python scripts/benchmarks/compile_times.py [--json FILE]

Each part is a process of its own. The cold ones begin with an empty cache of numba in a temporary
folder. ``first_command`` simulates the arm for 0.1 s from the command line; ``everything`` compiles
what any shipped rig or bench of a paper can ask for: the kernel, its checks, the gauges, and every
force law and hysteresis operator.
"""

from __future__ import annotations

import functools
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from timing import finish, parser
from timing import seconds as seconds_of

COMMAND = ("-m", "pamsim", "step", "--pressure", "100,0", "--duration", "100ms")
EVERYTHING = """
import numpy as np
from pamsim.engine import compiled, gauges, plugin
from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.physics.record import SIZE, slot
plugin.load_kernel(), gauges.compiled_read(), compiled.checked_end()
rows = []
for law in FORCE_LAWS.own():
    for operator in (None, *OPERATORS.own()):
        row = np.zeros(SIZE)
        row[slot("force.law")] = FORCE_LAWS.code(law.group)
        row[slot("hysteresis.law")] = OPERATORS.code(operator.group) if operator else 0.0
        rows.append(row)
compiled.prepare(rows)
"""


def seconds(*args: str, cache: Path) -> float:
    """Time of a process with a cache of numba."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    command = [sys.executable, *args]
    return seconds_of(
        functools.partial(subprocess.run, command, env=environment, check=True, capture_output=True)
    )


def measured(*args: str) -> dict[str, Any]:
    """Seconds with an empty cache and with a full one (median of five), and the cache's size."""
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder)
        cold = seconds(*args, cache=cache)
        warm = statistics.median(seconds(*args, cache=cache) for _ in range(5))
        size = sum(file.stat().st_size for file in cache.rglob("*") if file.is_file())
    return {"cold_s": cold, "warm_s": warm, "cache_MB": size / 1e6}


def main() -> None:
    """Time them and print."""
    target = parser(__doc__).parse_args().json
    result = {
        "first_command": measured(*COMMAND),
        "everything": measured("-c", EVERYTHING),
        "import_s": statistics.median(
            seconds("-c", "import pamsim.cli.main", cache=Path(tempfile.gettempdir()))
            for _ in range(5)
        ),
    }
    finish("compile_times.py", result, target)


if __name__ == "__main__":
    main()
