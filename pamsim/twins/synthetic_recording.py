"""Synthetic recordings with hidden effects, how they were made, and the ground truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pamsim.comparison.protocols import PROTOCOLS
from pamsim.core.encoding import to_dict
from pamsim.core.errors import InputError, nearest
from pamsim.core.recording import Recording, write_recording
from pamsim.engine.rig import Rig
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.store.json_file import write_json

SCHEMA = "pamsim-ground-truth/1"

FORMULATIONS = ("library", "independent")
"""Whether effects of the library are hidden as the library formulates them, or by an independent
model: another formula at half the rig's time step, which a diagnosis cannot reproduce exactly."""


@dataclass(frozen=True, kw_only=True)
class HideSettings:
    """How synthetic recordings are made.

    Attributes:
        protocols: names of the inputs, see `pamsim.comparison.protocols`.
        repeats: trials of each input, in each of its two settings.
        duration: of a trial [s]; the protocols' own if left out.
        coloured: True for noise half of which drifts (AR(1)), False for white noise.
        noise: factor on the sensors' noise.
        variation: relative standard deviation of what differs from trial to trial.
        forces: whether muscle forces are measured.
        formulation: one of `FORMULATIONS`.
        seed: random seed.

    Raises:
        InputError: for an unknown formulation, or no repeats.
    """

    protocols: tuple[str, ...] = tuple(PROTOCOLS)
    repeats: int = 4
    duration: float | None = None
    coloured: bool = False
    noise: float = 1.0
    variation: float = 0.003
    forces: bool = True
    formulation: str = "library"
    seed: int = 0

    def __post_init__(self) -> None:
        if self.repeats < 1:
            raise InputError(f"{self.repeats} repeats: at least one trial is needed")
        if self.formulation not in FORMULATIONS:
            raise InputError(
                f"no formulation {self.formulation!r}; {nearest(self.formulation, FORMULATIONS)}"
            )


@dataclass(frozen=True, kw_only=True)
class HiddenEffect:
    """One effect that was hidden.

    Attributes:
        name: of the effect.
        size: in units of its typical size.
        formulation: ``library``, or the independent model in words.
        resembles: effects of the library that would explain it; none for most effects from outside
            the library.
    """

    name: str
    size: float
    formulation: str
    resembles: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class SyntheticRecording:
    """Recordings of a rig with hidden effects, and the ground truth.

    Attributes:
        rig: without the effects.
        reference: name or path by which the recording finds the rig.
        effects: what was hidden.
        hidden: rig parameter -> value that makes the effects [SI].
        settings: how the recordings were made.
        trials: file stem -> noisy recording.
        protocols: file stem -> protocol.
    """

    rig: Rig
    reference: str
    effects: tuple[HiddenEffect, ...]
    hidden: Mapping[str, float]
    settings: HideSettings
    trials: Mapping[str, Recording]
    protocols: Mapping[str, str]

    def summary(self) -> str:
        """Effects and number of trials in one line."""
        hidden = " + ".join(f"{e.name} (size {e.size:g})" for e in self.effects) or "no effect"
        return f"{hidden} hidden in {len(self.trials)} trials of {self.rig.name}"

    def to_dict(self) -> dict[str, Any]:
        """The ground truth in JSON types; values in SI."""
        return to_dict(
            {
                "schema": SCHEMA,
                "rig": self.rig.name,
                "effects": self.effects,
                "parameters": {
                    name: {"value": value, "unit": rig_parameter(self.rig, name).spec.unit}
                    for name, value in self.hidden.items()
                },
                "settings": self.settings,
                "trials": len(self.trials),
            }
        )

    def save(self, folder: Path | str) -> Path:
        """Write the recording, and the ground truth in a file beside its folder.

        The recording names the rig without the effects. Nothing that reads the folder can read the
        ground truth.

        Args:
            folder: of the recording; made if need be.

        Returns:
            The file of the ground truth, ``<folder>.ground_truth.json``.

        Raises:
            InputError: if the folder cannot be written.
        """
        folder = Path(folder)
        if folder.exists() and not folder.is_dir():
            raise InputError(f"{folder} is a file; name a folder to write into")
        write_recording(
            folder, self.reference, self.trials, self.protocols, forces=self.settings.forces
        )
        file = folder.parent / f"{folder.name}.ground_truth.json"
        write_json(file, self.to_dict())
        return file
