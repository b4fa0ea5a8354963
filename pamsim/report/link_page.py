"""The page of a diagnosis by link: where the gap is, what is missing, what could be instead."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pamsim.comparison.compared_signal import Comparison, shown_unit
from pamsim.comparison.links import in_links
from pamsim.core.units import common_unit, to_si
from pamsim.diagnosis.bench import CONDITIONS
from pamsim.inference.model_comparison import DRAWN
from pamsim.inference.row_tests import ORDERS
from pamsim.recordings.signals import JOINT_KINDS, kind_of
from pamsim.report.numbers import digits, fixed, interval, quantity, significant, unit, words
from pamsim.report.page import inline_image, write_page
from pamsim.report.style import RULE, finish_axes, new_figure, plain_log_scale, styled
from pamsim.report.trial_signals import trial_channels, worst_trials
from pamsim.scene.series_colours import BLUE, GREEN, INK, MUTED, VERMILION

SCHEMA = "pamsim-diagnosis/3"

SUPPORTED: Mapping[str, tuple[str, str]] = {
    "no_gap": (
        "on data that no fit has seen the model misses by no more than its noise",
        "that the model is right: what the inputs do not excite is not tested",
    ),
    "named": (
        "this effect is missing, with this interval; every other effect tried predicts worse",
        "that nothing else could be the cause: only the effects tried were compared",
    ),
    "named_with_remainder": (
        "this effect is missing, and something else is left",
        "that its size is exact: what is left may bias it",
    ),
    "ambiguous": (
        "what is called certain, and no more",
        "the nearest formula as the cause",
    ),
    "unexplained": (
        "where simulation and measurement part, and that no effect tried explains it",
        "the nearest effect, or a learned curve, as the cause",
    ),
    "undecided": (
        "that no effect tried predicts unseen parts of the recording better",
        "that the model agrees, or that something is missing: what is held out does not show which",
    ),
}
"""Verdict -> what a paper may state of it, and what not."""

_WIDTH_IN = 5.2  # a phone shows it at two thirds, where it can still be read
_BAR = 0.36  # thickness; links are 1 apart
_CURVE_IN = 2.4  # height of a curve's axes
_ROOM = 0.4  # above and below a learned curve, as a share of its height
_BELOW = 0.7  # of the noise, where bars begin: those that reach it are still seen
_FAR = 1.5  # of the root mean square: rows beyond it are named
_PRESSURE_BAR = 22.0  # width [kPa]
_DASHED = (0, (4, 3))
_CONDITION_UNITS = {"Pa": "bar", "rad": "rad"}  # as in the documentation of the tests


def write_link_diagnosis(
    result: Mapping[str, Any],
    comparisons: Sequence[Comparison],
    out: Path,
    *,
    film: Path | None = None,
    hidden: Hidden | None = None,
) -> Path:
    """Write page and figures of a diagnosis by link as `write_page` does; return the page.

    In the comparisons the whole chain is simulated. A film is a GIF of the first trial shown, see
    `pamsim.report.film.film_gap`. The page begins with what was hidden in synthetic recordings.
    """
    shown = shown_trials(result, comparisons)
    picture = hidden and hidden.picture
    return write_page(
        out,
        "link_diagnosis.html",
        result,
        lambda: dict(_figures(result, comparisons, shown)),
        schema=SCHEMA,
        headline=hidden.headline(result) if hidden else headline(result),
        supported=SUPPORTED,
        shown=shown,
        hidden=hidden,
        picture=picture and inline_image(picture.read_bytes(), "jpeg"),
        film=None if film is None else inline_image(film.read_bytes(), "gif"),
        filmed=_filmed(comparisons, shown),
        least=_least_p_value(result),
        in_links=in_links,
        grouped=_grouped,
        physical_words=physical_words,
    )


def shown_trials(result: Mapping[str, Any], comparisons: Sequence[Comparison]) -> list[str]:
    """Held-out trials that the page shows, the one with the largest gap first."""
    return worst_trials(comparisons, _noise(result))


def first_figure(result: Mapping[str, Any]) -> tuple[str, Figure]:
    """Name and figure of where the gap is: of links, of a table's rows, or of a loop."""
    if result["rows"]:
        return "rows", row_errors(result)
    if result["branches"]:
        return "branches", loop_branches(result)
    return "links", link_bars(result["links"], repaired=bool(result["effects"]))


def _noise(result: Mapping[str, Any]) -> dict[str, float]:
    """Channel of recordings -> noise [SI], where it is known and not 0."""
    if result["rows"] or result["branches"]:
        return {}
    return {
        name: gap["floor"] / shown_unit(name)[1]
        for name, gap in result["gap"].items()
        if gap["floor"]
    }


def _figures(
    result: Mapping[str, Any], comparisons: Sequence[Comparison], shown: Sequence[str]
) -> Iterator[tuple[str, Figure]]:
    yield first_figure(result)
    if result["learned"]:
        yield "learned", learned_curves(result["learned"])
    noise = _noise(result)
    for number, trial in enumerate(shown, 1):
        parts = [part for part in comparisons if part.trial == trial]
        yield f"trial_{number}", trial_channels(parts, noise)


def _filmed(comparisons: Sequence[Comparison], shown: Sequence[str]) -> str:
    """What the film of the first trial shows, with the misfits of its first joint."""
    joints = [c for c in comparisons if c.trial in shown[:1] and kind_of(c.channel) in JOINT_KINDS]
    if not joints:
        return ""
    first = joints[0]
    of = shown_unit(first.channel)[0]
    before, after = (
        f"{fixed(first.rms(values), 2)} {of}" if values is not None else ""
        for values in (first.before, first.after)
    )
    text = f"as measured; as simulated, {words(first.channel)} off by {before or 'no number'} RMS"
    return f"{text} before the repair and by {after} after it" if after else text


def _least_p_value(result: Mapping[str, Any]) -> float:
    """Smallest p-value: of flips of so many units' signs, and at rest of orders of the rows."""
    held_out = len(result["run"]["held_out"]) if result["run"] else math.inf
    at_rest = result["rows"] or result["branches"]
    return max(0.5**held_out, 1.0 / ((ORDERS if at_rest else DRAWN) + 1))


def _grouped(names: Sequence[str]) -> str:
    """Names of trials, those that differ in their last number together."""
    stems = Counter(re.sub(r"[_ ]?\d+$", "", name) or name for name in names)
    return ", ".join(f"{stem} ({n})" if n > 1 else stem for stem, n in stems.items())


@styled
def learned_curves(learned: Sequence[Mapping[str, Any]]) -> Figure:
    """Learned curves with their bands, one below the other."""
    figure, axes = new_figure(_CURVE_IN * len(learned), len(learned), 1, width_in=_WIDTH_IN)
    for ax, one in zip(axes, learned, strict=True):
        low, high = np.array(one["band95"], dtype=np.float64).T  # none where it is not known
        ax.fill_between(one["at"], low, high, color=BLUE, alpha=0.2, linewidth=0.0)
        ax.plot(one["at"], one["value"], color=BLUE)
        ends = float(np.min(one["value"])), float(np.max(one["value"]))
        room = _ROOM * (ends[1] - ends[0])
        if room > 0.0:  # a band as wide as nothing is known would hide the curve
            ax.set_ylim(ends[0] - room, ends[1] + room)
        unit = one["unit"].replace("*", " ")
        x = f"{one['over']} of {one['joint'] or one['acts_at']} [{one['at_unit']}]"
        quantity = one["kind"].partition(" over ")[0].partition(" ")[2]
        if one["where"] != one["acts_at"]:
            quantity += f" of {one['acts_at']}"
        finish_axes(ax, x=x, y=f"{quantity} [{unit}]")
    return figure


@styled
def row_errors(result: Mapping[str, Any]) -> Figure:
    """Errors of rows over the pressure that all muscles share, before and after a diagnosis."""
    states = [("before_deg", VERMILION, "rig, nuisance parameters refitted")]
    if result["effects"]:
        states.append(("after_deg", BLUE, "with the effects that were found"))
    figure, axes = new_figure(2.2 * len(states), rows=len(states), sharey=True)
    for ax, state in zip(axes, states, strict=True):
        _rows(ax, result["rows"], *state)
    axes[-1].set_xlabel("lower pressure of the row [kPa]")
    return figure


@styled
def loop_branches(result: Mapping[str, Any]) -> Figure:
    """The loop that was diagnosed, and the difference of its branches with what was found."""
    figure, (loop, apart) = new_figure(5.6, rows=2, sharex=True, height_ratios=(1.25, 1.0))
    branches = result["branches"]
    pressure, opened, error = (branches[key] for key in ("pressure_kpa", "opened_mm", "error_mm"))
    rising, falling = (np.array(branches[f"{word}_mm"]) for word in ("rising", "falling"))
    middle = 0.5 * (rising + falling)
    base = {"color": MUTED, "linestyle": _DASHED, "label": "reversible curve"}
    loop.plot(pressure, middle, **base)
    shown: list[Any] = [
        apart.bar(
            pressure, rising - falling, width=_PRESSURE_BAR, color=RULE, zorder=2, yerr=error,
            error_kw={"ecolor": INK, "elinewidth": 0.9, "capsize": 2.5},
            label="readings" if error is None else "readings ± standard error",
        ),
        apart.axhline(0.0, zorder=3, **base),
    ]  # fmt: skip
    sides = (("rising", rising, 0.5, BLUE, "^"), ("falling", falling, -0.5, VERMILION, "v"))
    for word, read, half, colour, marker in sides:
        loop.plot(pressure, read, marker, color=colour, markersize=5, label=f"readings, {word}")
        if opened is not None:
            loop.plot(pressure, middle + half * np.array(opened), color=colour, linewidth=1.1)
    if opened is not None:
        name = " + ".join(words(one["effect"]) for one in result["effects"])
        loop.plot([], [], color=INK, linewidth=1.1, label=name)
        shown += apart.plot(
            pressure, opened, "D-", color=GREEN, markersize=4, linewidth=1.1, label=name
        )
    finish_axes(loop, y="length [mm]", zero=False)
    loop.legend(loc="upper right")
    finish_axes(
        apart, x="gauge pressure [kPa]", y="rising − falling [mm]",
        title="difference of the branches", zero=False,
    )  # fmt: skip
    apart.use_sticky_edges = False  # or the line at zero would lie on the frame
    apart.margins(y=0.06)
    apart.legend(handles=shown, loc="upper right")
    return figure


def _rows(ax: Axes, rows: list[Mapping[str, Any]], key: str, colour: str, title: str) -> None:
    common = np.array([min(row["pressure_kpa"]) for row in rows])
    off = np.array([row[key] for row in rows])
    ax.plot(common, off, "o", color=colour, markersize=4.5, zorder=3)
    rms = float(np.sqrt(np.mean(off**2)))
    # Rows without common pressure lie on one another; names of neighbours go up and down in turn.
    far = np.flatnonzero((np.abs(off) > _FAR * rms) & (common > 0.0))
    for turn, i in enumerate(far[np.argsort(common[far], kind="stable")]):
        ax.annotate(
            rows[i]["row"], (common[i], off[i]), xytext=(5, 2), textcoords="offset points",
            fontsize=8, color=MUTED, va="top" if turn % 2 else "bottom",
        )  # fmt: skip
    finish_axes(ax, y="simulated − measured [deg]", title=f"{title}: {fixed(rms, 2)} deg RMS")


@styled
def link_bars(links: Sequence[Mapping[str, Any]], *, repaired: bool) -> Figure:
    """Held-out misfit of every link over its noise, from the command down.

    It is that before, and where effects were found (``repaired``) that after.
    """
    figure, (ax,) = new_figure(0.9 + 0.55 * len(links), width_in=_WIDTH_IN)
    states = [("before", VERMILION), ("after", BLUE)] if repaired else [("before", GREEN)]
    if not repaired and any(one["more_left"] is not False for one in links):
        states = [("before", VERMILION)]
    most = 2.0
    for place, one in enumerate(links):
        for number, (state, colour) in enumerate(states):
            if one[state] is None:  # its simulation breaks down
                continue
            at = place + (number - 0.5 * (len(states) - 1)) * _BAR
            value = max(one[state], _BELOW)
            most = max(most, value)
            ax.barh(at, value - _BELOW, height=0.94 * _BAR, left=_BELOW, color=colour)
            ax.annotate(
                significant(one[state], 3), (max(value, 1.0), at), (3, 0),
                textcoords="offset points", ha="left", va="center", fontsize=8.5,
            )  # fmt: skip
    ax.axvline(1.0, color=INK, linewidth=1.2)
    plain_log_scale(ax)
    ax.set_xlim(_BELOW, most**1.15 * 1.2)
    labels = [f"{one['link']}\n{' → '.join(one['signals'])}" for one in links]
    ax.set_yticks(range(len(links)), labels)
    ax.set_ylim(len(links) - 0.4, -0.6)
    finish_axes(ax, x="misfit / noise (mean squares)", zero=False)
    ax.grid(False, axis="y")
    ax.grid(True, axis="x")
    ax.tick_params(axis="y", length=0)
    for state, colour in states:
        label = state if repaired else "simulated"
        ax.plot([], [], color=colour, linewidth=5, label=label)
    ax.plot([], [], color=INK, linewidth=1.2, label="noise")
    figure.legend(loc="outside upper right", ncols=3)
    return figure


def physical_words(
    physical: Mapping[str, Mapping[str, Any]], parameters: Mapping[str, Mapping[str, Any]]
) -> str:
    """Write the size of an effect of a diagnosis, by quantity.

    Such as ``loop half width 15.0 [13.2, 16.8] N; energy per cycle 0.160 [0.140, 0.180] J (test:
    pressure 2.5 bar, contraction amplitude 1.5 %)``; empty without a size. What the effect cannot
    change is left out, and so is a quantity that is one of its parameters or named before.
    """
    sizes: list[str] = []
    written = [(p["value_si"], p["unit_si"], list(p["interval95_si"])) for p in parameters.values()]
    conditions: dict[str, str] = {}
    for name, entry in physical.items():
        plain = name.rpartition(".")[2] if name.rpartition(".")[2] in CONDITIONS else name
        if plain in CONDITIONS:
            shown = _CONDITION_UNITS.get(entry["unit"], common_unit(entry["unit"]))
            value = to_si(entry["value"], entry["unit"], shown, where=name)
            conditions[words(plain).removeprefix("at ")] = quantity(value, shown, 2)
            continue
        ends = entry["interval95"]
        same = entry["value"], entry["unit"], ends and list(ends)
        if same not in written and (ends is None or ends[0] != ends[1]):
            written.append(same)
            sizes.append(_sized(name, *same))
    tested = ", ".join(f"{name} {value}" for name, value in conditions.items())
    return "; ".join(sizes) + (f" (test: {tested})" if tested and sizes else "")


def _sized(name: str, value: float, si_unit: str, ends: Sequence[float] | None) -> str:
    shown = common_unit(si_unit)
    numbers = [to_si(number, si_unit, shown, where=name) for number in (value, *(ends or ()))]
    shared = digits(numbers[0], numbers[1:])
    text = f"{words(name.replace('.', ': '))} {significant(numbers[0], shared)}"
    if ends is not None:
        text += f" [{', '.join(significant(end, shared) for end in numbers[1:])}]"
    return f"{text} {unit(shown)}".rstrip()


def headline(result: Mapping[str, Any]) -> str:
    """What was found, in a few words."""
    if result["effects"]:
        return f"Missing: {' and '.join(words(one['certain_words']) for one in result['effects'])}"
    if result["remainder"]:
        shape = ", but its shape is learned" if result["learned"] else ""
        return f"No effect tried explains the gap {in_links(result['remainder'])}{shape}"
    if result["verdict"] == "undecided":
        return "Undecided: what is left may be noise or a missing effect"
    return "No gap: nothing is missing that these data can show"


class Hidden(NamedTuple):
    """What was hidden in the synthetic recordings that a page is about.

    Attributes:
        effect: its name.
        missing: what a model without it is missing, as the end of a sentence.
        parameters: name -> value and its unit, that of the rig's file.
        tried: names of the effects that the diagnosis tried.
        picture: a JPEG of the rig; None if it could not be drawn.
    """

    effect: str
    missing: str
    parameters: Mapping[str, tuple[float, str]]
    tried: Sequence[str]
    picture: Path | None = None

    def named_in(self, result: Mapping[str, Any]) -> bool:
        """Whether a diagnosis names it, and nothing else."""
        return {one["name"] for one in result["effects"]} == {self.effect}

    def size(self) -> str:
        """Its parameters in words."""
        return ", ".join(f"{n} = {quantity(v, of, 3)}" for n, (v, of) in self.parameters.items())

    def sized_in(self, result: Mapping[str, Any]) -> Mapping[str, Any] | None:
        """Value and interval of its first parameter, if the diagnosis names it by this one."""
        return result["effects"][0]["sizes"].get(self._first) if self.named_in(result) else None

    def inside(self, result: Mapping[str, Any]) -> bool:
        """Whether the interval of its first parameter holds what was hidden."""
        found = self.sized_in(result)
        if found is None or None in found["interval95"]:
            return False
        low, high = found["interval95"]
        return low <= self.parameters[self._first][0] <= high

    def headline(self, result: Mapping[str, Any]) -> str:
        """What was hidden and what was found, with the interval."""
        hid = f"We hid {quantity(*self.parameters[self._first], 3)} of {words(self.effect)}"
        text = f"{hid} in a synthetic recording. pamsim "
        found = self.sized_in(result)
        if found is None:
            names = "named it by another formula" if self.named_in(result) else "did not name it"
            return f"{text}{names}. {headline(result)}"
        shared = digits(found["value"], found["interval95"])
        between = interval(found["interval95"], shared).replace(" to ", ", ")
        value = f"{significant(found['value'], shared)} [{between or 'no interval'}]"
        return f"{text}found {value} {unit(found['unit'])}".rstrip() + "."

    @property
    def _first(self) -> str:
        return next(iter(self.parameters))
