"""The experiment that would tell the tied models apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class NextExperiment:
    """What to record next.

    Attributes:
        protocol: of the menu, the one that separates the models best.
        shows: what it is for.
        between: names of the models that it separates.
        before: distance between them in the present data, in noise floors.
        after: the same with the experiment.
        menu: protocol -> distance with it.
        advice: the effect's own separating experiment, in words.
    """

    protocol: str
    shows: str
    between: tuple[str, ...]
    before: float
    after: float
    menu: Mapping[str, float]
    advice: str
