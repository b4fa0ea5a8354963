"""How the time of a diagnosis grows with joints, muscles and trials, as exponents.

    python scripts/benchmarks/diagnosis_costs.py [--json FILE]

Every case hides viscous friction at one joint and diagnoses the recordings by the public
`pamsim.diagnose` in one thread, all usual effects tried. Time is the processor's, of one diagnosis
each: it is minutes for the largest. Rigs are planar arms from the templates of `pamsim new-rig`:

- joints: 1 to 3, with two muscles at each, 18 trials;
- muscles: 2 to 6 at one joint, 18 trials;
- trials: 18 to 72 of one joint and two muscles, by more repeats of the same inputs.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from scaling import exponent
from timing import parser, print_and_write
from tqdm import tqdm

import pamsim
from pamsim.core.computation import versions
from pamsim.engine.new_rig import new_rig

PROTOCOLS = ("triangle", "multisine", "bursts")
DURATION = 3.0
FRICTION = 3.5
"""Hidden, in typical sizes: several times what repeats differ by."""

Case = tuple[str, int, int, int, int]
"""Work, its size, joints, muscles and repeats."""


def cases() -> Iterator[Case]:
    """All cases; those of one joint, two muscles and three repeats are the same one."""
    for joints in (1, 2, 3):
        yield "joints", joints, joints, 2 * joints, 3
    for muscles in (2, 4, 6):
        yield "muscles", muscles, 1, muscles, 3
    for repeats in (3, 6, 12):
        yield "trials", 6 * repeats, 1, 2, repeats


def arm(folder: Path, joints: int, muscles: int) -> Path:
    """A rig of some links in a chain, each shorter and lighter, the muscles shared out in pairs."""
    bodies, ends, tendons = "", "", ""
    for i in range(joints):
        long, mass = 0.2 / 1.3**i, 0.3 / 1.5**i
        at = 0.0 if i == 0 else 0.2 / 1.3 ** (i - 1)
        inertia = mass * long * long / 10.0
        bodies += (
            f'<body name="link_{i}" pos="{at:.6g} 0 0">'
            f'<joint name="joint_{i}" axis="0 0 1" range="-1 1"/>'
            f'<inertial pos="{long / 2.0:.6g} 0 0" mass="{mass:.6g}"'
            f' diaginertia="1e-4 {inertia:.6g} {inertia:.6g}"/>'
        )
        ends += "</body>"
    for i in range(muscles):
        radius = (-0.025 if i % 2 == 0 else 0.025) / 1.2 ** (i // 2 % joints)
        tendons += (
            f'<fixed name="muscle_{i}"><joint joint="joint_{i // 2 % joints}"'
            f' coef="{radius:.6g}"/></fixed>'
        )
    path = folder / "arm.xml"
    path.write_text(
        '<mujoco><compiler angle="radian"/><option timestep="0.0005" integrator="Euler"/>'
        f"<worldbody>{bodies}{ends}</worldbody><tendon>{tendons}</tendon></mujoco>",
        encoding="utf-8",
    )
    return new_rig("arm", mjcf=path, out=folder / "rig")


def run(joints: int, muscles: int, repeats: int) -> dict[str, Any]:
    """Hide and diagnose; what was found, and how long that took."""
    with tempfile.TemporaryDirectory() as place:
        rig = arm(Path(place), joints, muscles)
        folder = Path(place) / "data"
        made = pamsim.hide(
            rig,
            {"viscous_friction at joint_0": FRICTION},
            protocols=PROTOCOLS,
            duration=DURATION,
            repeats=repeats,
            seed=1,
        )
        made.save(folder)
        began = time.process_time()
        found = pamsim.diagnose(folder, threads=1).to_dict()
        seconds = time.process_time() - began
    return {
        "trials": len(made.trials),
        "processor_seconds": round(seconds, 1),
        "verdict": found["verdict"],
        "named": [one["name"] for one in found["effects"]],
    }


def main() -> None:
    """Run every case once, print and write."""
    target = parser(__doc__).parse_args().json
    done: dict[tuple[int, int, int], dict[str, Any]] = {}
    rows: list[dict[str, Any]] = []
    for work, size, joints, muscles, repeats in tqdm(list(cases()), unit="diagnosis"):
        key = joints, muscles, repeats
        if key not in done:
            done[key] = run(*key)
        rows.append({"work": work, "size": size, "joints": joints, "muscles": muscles, **done[key]})
        print(rows[-1], flush=True)
    exponents: dict[str, dict[str, float]] = {}
    for work in ("joints", "muscles", "trials"):
        own = [row for row in rows if row["work"] == work]
        sizes, seconds = [row["size"] for row in own], [row["processor_seconds"] for row in own]
        slope, error = exponent(sizes, seconds)
        exponents[work] = {"exponent": slope, "standard_error": error}
        print(f"{work:8s} {slope:.2f} +- {error:.2f}")
    result = {
        "command": "python scripts/benchmarks/diagnosis_costs.py",
        "seconds_of_a_trial": DURATION,
        "rows": rows,
        "exponents": exponents,
        "versions": versions(),
    }
    print_and_write(result, target)


if __name__ == "__main__":
    main()
