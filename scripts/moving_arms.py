"""The arm that moves beside the curves of an effect, in the same small SVG."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from pictures import GREY

from pamsim.core.units import DEG_PER_RAD, FloatArray
from pamsim.scene.series_colours import VERMILION

FRAMES_PER_SECOND = 10
"""Between two frames the browser moves the arm evenly; more are not seen."""
SEEN = 8.0
"""[deg] between two arms of this size is seen at a glance."""
FACTORS = (1, 2, 5, 10, 20, 50)
"""By which a change is drawn larger; beyond the last it is too small to be shown at all."""
ROD = 1.0  # length of the drawn arm; the panel's scale follows


def draw_arms(axes: Axes, change: FloatArray, *, unseen: float) -> float:
    """Draw the arm without and with the effect, hanging, ready to be turned.

    ``change`` [rad] is what the effect adds to the angle; below ``unseen`` [rad] it is drawn as it
    is. Returns the factor by which it is drawn larger.
    """
    largest = float(np.max(np.abs(change))) * DEG_PER_RAD
    enough = (each for each in FACTORS if each * largest >= SEEN)
    factor = next(enough, FACTORS[-1]) if largest > unseen * DEG_PER_RAD else 1
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(-0.6 * ROD, 0.6 * ROD)
    axes.set_ylim(-1.1 * ROD, 0.25 * ROD)
    round_ends = {"solid_capstyle": "round"}
    axes.plot((0, 0), (0, -ROD), color=GREY, alpha=0.6, lw=6, gid="without", **round_ends)
    axes.plot((0, 0), (0, -ROD), color=VERMILION, lw=2.5, gid="with", **round_ends)
    axes.plot(0, 0, "o", color=GREY, ms=10)
    axes.text(-0.03, 0.2 * ROD, "without", color=GREY, ha="right", fontsize="small")
    axes.text(0.03, 0.2 * ROD, "with", color=VERMILION, ha="left", fontsize="small")
    if factor > 1:
        note = f"change drawn {factor} times"
        axes.text(0, -1.1 * ROD, note, color=GREY, ha="center", va="top", fontsize="small")
    return factor


def animate(
    path: Path,
    arms: Axes,
    curves: Axes,
    time: FloatArray,
    without: FloatArray,
    with_effect: FloatArray,
) -> None:
    """Let the arms of a written SVG turn by their angles [rad], and a cursor run over the curves.

    Who asks the browser for less motion sees them at rest.
    """
    length = float(time[-1])
    at = np.linspace(0.0, length, round(length * FRAMES_PER_SECOND) + 1)
    points = 72.0 / arms.figure.dpi
    x, y = arms.transData.transform((0.0, 0.0)) * points
    pivot = f"transform-origin:{x:.1f}px {arms.figure.bbox.height * points - y:.1f}px"
    rules = [f"@keyframes run{{to{{transform:translateX({curves.bbox.width * points:.1f}px)}}}}"]
    for name, angle in (("without", without), ("with", with_effect)):
        turns = np.interp(at, time, angle) * DEG_PER_RAD
        frames = (
            f"{100 * now / length:.3g}%{{rotate:{-turn:.3g}deg}}"
            for now, turn in zip(at, turns, strict=True)
        )
        rules.append(f"@keyframes {name}{{{''.join(frames)}}}")
        rules.append(f"#{name}{{{pivot};animation:{name} {length:g}s linear infinite}}")
    rules.append(f".cursor{{animation:run {length:g}s linear infinite}}")
    rules.append("@media(prefers-reduced-motion){#without,#with,.cursor{animation:none}}")
    text = path.read_text(encoding="utf-8").replace('id="cursor"', 'class="cursor"')
    moving = text.replace("<defs>", f"<style>{''.join(rules)}</style>\n <defs>", 1)
    path.write_text(moving, encoding="utf-8")
