"""``pamsim demo``: hide an effect, diagnose it, open the page."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from pamsim.cli import options
from pamsim.cli.command import Command, answer, exit_code, progress_bar, warn
from pamsim.cli.diagnose import show

_RIG = "mas20_arm"
_SIZE = 0.3
_TRIALS = {"protocols": ("triangle", "loaded_steps"), "duration": 2.0, "repeats": 5}
_PICTURE = 768, 480  # width and height [px]: twice what the page shows, for sharp screens


@click.command(name="demo", cls=Command)
@click.argument(
    "effect", default="coulomb_friction", shell_complete=options.completed(options.effect_names)
)
@click.option("--size", type=float, default=_SIZE, help="In typical sizes.")
@options.seed("Random seed of noise and search.")
@options.out("Folder for recording, page and repaired rig.", default="pamsim_demo")
@click.option("--film/--no-film", default=True, help="Film the trial with the largest gap.")
@click.option("--open/--no-open", "opened", default=None, help="Show the page in a browser.")
def command(effect: str, size: float, seed: int, out: Path, film: bool, opened: bool | None) -> int:
    """Hide EFFECT in recordings of the MAS-20 arm, find it, and open the page about it.

    The recordings are synthetic: 20 trials of 2 s with noise, of an arm that has the effect. The
    diagnosis gets them with the arm's model without EFFECT, and tries EFFECT and all effects
    that it is mistaken for. Exit 0 if EFFECT is named, 1 if not. `pamsim list effects` lists
    what can be hidden.
    """
    import pamsim
    from pamsim.comparison.readable_unit import readable, readable_unit
    from pamsim.effects.catalog import effect as look_up
    from pamsim.engine.parameters import rig_parameter
    from pamsim.report.link_page import Hidden

    if size == 0.0:
        raise click.UsageError("a --size of 0 hides nothing; give one such as 1")
    rig = pamsim.load_rig(_RIG)
    found = look_up(effect)
    tried = [found.name, *(n for n in found.look_alikes if look_up(n).in_trials)]
    click.echo(f"hiding {found.name} in 20 trials of the arm; compiles for a minute the first time")
    recorded = pamsim.hide(rig, {effect: size}, seed=seed, **_TRIALS)
    recorded.save(out / "recording")
    with progress_bar("fit") as progress:
        report = pamsim.diagnose(out / "recording", effects=tried, seed=seed, progress=progress)
    own = {name: rig_parameter(rig, name) for name in recorded.hidden}
    hidden = Hidden(
        effect=found.name,
        missing=found.missing,
        parameters={
            name: (readable(own[name], value), readable_unit(own[name]))
            for name, value in recorded.hidden.items()
        },
        tried=tried,
        picture=_pictured(out / "arm.jpg") if film else None,
    )
    right = hidden.named_in(report.to_dict())
    show(report, out, None, film=out / "recording" if film else None, hidden=hidden)
    answer(f"hidden was {found.name}, {hidden.size()}: {'' if right else 'not '}named by itself")
    if opened if opened is not None else sys.stdout.isatty():
        click.launch(str((out / "index.html").resolve()))
    return exit_code(right)


def _pictured(path: Path) -> Path | None:
    """A picture of the rig; the page stands if it cannot be drawn."""
    from pamsim.core.errors import PamsimError
    from pamsim.scene.picture import picture_rest

    try:
        picture_rest(path, rig=_RIG, size=_PICTURE)
    except PamsimError as error:
        warn(f"no picture: {error}")
        return None
    return path
