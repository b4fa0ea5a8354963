"""Steps per second of the arm's environment against a task of MyoSuite, at its frame skip.

    pip install myosuite
    python scripts/benchmarks/myosuite_steps.py [--json FILE]

The task moves an elbow by six of MuJoCo's muscles on spatial tendons; the arm's joint is moved by
two pneumatic muscles on fixed ones. Both as `gymnasium.make` gives them, timed in turn as in
`environment_steps.py`, whose remarks hold here, too. MyoSuite is no requirement of pamsim.
"""

from __future__ import annotations

import importlib

import gymnasium
from environment_steps import ROUNDS, compare, single
from timing import finish, parser

OURS, PEER = "pamsim/PamArmPressure-v0", "myoElbowPose1D6MRandom-v0"
FRAME_SKIP = 10
"""The peer's own."""


def main() -> None:
    """Time both, print, write."""
    target = parser(__doc__).parse_args().json
    try:
        importlib.import_module("myosuite")  # registers its tasks
    except ModuleNotFoundError:
        print("MyoSuite is not installed: nothing is timed")
        return
    if gymnasium.make(PEER).unwrapped.frame_skip != FRAME_SKIP:
        raise ValueError(f"{PEER} has another frame skip than {FRAME_SKIP}")
    ours, theirs = single(OURS, FRAME_SKIP), single(PEER, FRAME_SKIP)
    runs = [compare(ours, theirs) for _ in range(3)]
    result = {
        "environment": OURS,
        "peer": PEER,
        "frame_skip": FRAME_SKIP,
        "rounds": ROUNDS,
        "ratios": [round(ratio, 3) for _, ratio in runs],
        "steps_per_second": [round(1.0 / seconds) for seconds, _ in runs],
    }
    finish("myosuite_steps.py", result, target, "myosuite")


if __name__ == "__main__":
    main()
