"""``pamsim hide``: synthetic recordings with hidden effects."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pamsim.cli import options
from pamsim.cli.command import Command, answer, progress_bar, save_json

if TYPE_CHECKING:
    from pamsim.twins.synthetic_recording import SyntheticRecording


@click.command(name="hide", cls=Command)
@click.argument("effects", shell_complete=options.completed(options.effect_names, "+"))
@options.out("Folder to write.", required=True)
@options.rig
@click.option(
    "--size",
    type=options.Quantities("1", "1"),
    default="1",
    help="Of each effect, in typical sizes.",
)
@options.names(
    "--protocols",
    names=options.protocol_names,
    help="Inputs, such as triangle,bursts, or stretch,isometric,relaxation of a machine that moves"
    " the joints; all but these if left out",
)
@click.option("--repeats", type=int, default=4, help="Trials per setting.")
@click.option("--duration", type=options.SECONDS, help="Of a trial, such as 5s; 8 s if left out.")
@click.option("--coloured", is_flag=True, help="Noise half of which drifts; white if left out.")
@click.option("--noise", type=float, default=1.0, help="Factor on all noise.")
@click.option("--variation", type=float, default=0.003, help="From trial to trial.")
@click.option("--quantised", is_flag=True, help="In steps of the rig's encoder and converter.")
@click.option("--measured-drive", is_flag=True, help="Record pressures alone, no commands.")
@click.option("--no-forces", is_flag=True, help="Measure no muscle forces.")
@options.seed()
@options.json
def command(**given: Any) -> None:
    """Record a rig in which EFFECTS are hidden: air_leak, or air_leak+coulomb_friction, or none.

    "coulomb_friction at elbow" hides one at a joint of several, "air_leak at biceps" in one muscle.

    Writes a recording folder and, beside it, the ground truth.
    """
    from pamsim.twins.hide import hide

    return record(hide, **given)


def record(
    hide: Callable[..., SyntheticRecording],
    *,
    effects: str,
    out: Path,
    rig: str,
    size: list[float],
    no_forces: bool,
    json_file: Path | None,
    **choices: Any,
) -> None:
    """Record; write the recording and the ground truth, and print their places.

    All but ``hide``, which is `pamsim.hide` or takes the same arguments, are the command's options.
    """
    from pamsim.core.files import refuse_existing
    from pamsim.twins.synthetic_recording import ground_truth_file

    refuse_existing(ground_truth_file(out), options.forced())
    names = [] if effects == "none" else [part.strip() for part in effects.split("+")]
    if len(set(names)) < len(names):
        raise click.UsageError(f"{effects} has an effect twice; give it once, with its --size")
    sizes = size * len(names) if len(size) == 1 else size
    if len(sizes) != len(names):
        raise click.UsageError(
            f"--size has {len(sizes)} numbers, {effects} needs {len(names)}: one for each effect,"
            " or one for all"
        )
    if 0.0 in sizes:
        raise click.UsageError("a --size of 0 hides nothing; for a recording of nothing hide none")
    with progress_bar("trial") as progress:
        hidden = dict(zip(names, sizes, strict=True))
        recording = hide(rig, hidden, progress=progress, forces=not no_forces, **choices)
    ground_truth = recording.save(out)
    save_json(json_file, recording.to_dict())
    click.echo(f"recording: {out}")
    click.echo(f"ground truth: {ground_truth}")
    answer(recording.summary())
