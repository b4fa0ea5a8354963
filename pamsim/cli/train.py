"""``pamsim train``: a policy for any rig by reinforcement learning."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, answer, progress_bar


@click.command(name="train", cls=Command)
@click.option("--out", type=options.PATH, required=True, help="File to write, such as policy.npz.")
@options.rig
@click.option(
    "--task",
    default="sine",
    shell_complete=options.listed("pamsim.envs.tasks", "TASKS"),
    help="Task of the environment.",
)
@click.option("--action", default="pressure_set", help="pressure_set or valve.")
@options.load("Mass on the rig: 1.2 or 1200g.", default="0")
@click.option(
    "--top-pressure",
    type=options.Quantity("kPa", "Pa"),
    help="Largest set point, such as 400 (kPa); the supply's if left out.",
)
@click.option("--steps", type=int, default=600_000, help="Of 32 rigs together.")
@options.seed()
@options.force
def command(out: Path, top_pressure: float | None, **choices: Any) -> None:
    """Train a policy with stable-baselines3's PPO on 32 rigs and one core.

    Writes the policy as plain numbers, which `pamsim.controllers.neural_policy` runs without
    PyTorch, and beside it settings, versions and learning curve. Needs pip install "pamsim[rl]".
    """
    from pamsim.core.files import refuse_existing
    from pamsim.envs.train import policy_files, train

    for file in policy_files(out):
        refuse_existing(file, options.forced())
    if top_pressure is not None:
        choices["top_pressure"] = top_pressure
    with progress_bar("step") as progress:
        result = train(progress=progress, **choices)
    files = result.save(out, force=options.forced())
    click.echo(f"wrote {' and '.join(map(str, files))}")
    answer(result.summary())
