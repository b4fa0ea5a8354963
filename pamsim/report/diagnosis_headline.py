"""What heads the page of a diagnosis: what was found, beside what was hidden if that is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pamsim.report.numbers import digits, interval, quantity, significant, unit, words


def headline(result: Mapping[str, Any]) -> str:
    """What was found, in a few words."""
    if result["effects"]:
        return f"Missing: {' and '.join(one['certain_words'] for one in result['effects'])}"
    if result["remainder"]:
        shape = ", but its shape is learned" if result["learned"] else ""
        return f"No effect tried explains the gap in {' and '.join(result['remainder'])}{shape}"
    if result["verdict"] == "undecided":
        return "Undecided: without repeats, what is left may be noise or a missing effect"
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
