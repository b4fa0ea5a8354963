"""Synthetic recordings with hidden effects, how they were made, and the ground truth."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pamsim.comparison.protocols import RATE
from pamsim.core.encoding import to_dict, write_json
from pamsim.core.errors import InputError
from pamsim.core.files import refuse_file
from pamsim.engine.parameters import rig_parameter
from pamsim.engine.rig import Rig
from pamsim.recordings.recording import Recording, write_recording
from pamsim.recordings.recording_checks import FEWEST_ROWS

SCHEMA = "pamsim-ground-truth/3"


def ground_truth_file(folder: Path) -> Path:
    """File of the ground truth of the recording in a folder: beside it, not in it."""
    return folder.parent / f"{folder.name}.ground_truth.json"


@dataclass(frozen=True, kw_only=True)
class HideSettings:
    """How synthetic recordings are made.

    Attributes:
        protocols: names of the inputs: of `pamsim.comparison.protocols`, all that the rig can take
            if left out, or of `pamsim.comparison.protocols.IMPOSED_MOTIONS`.
        repeats: trials of each input, in each of its two settings.
        duration: of a trial [s]; the protocols' own if left out.
        coloured: True for noise half of which drifts (AR(1)), False for white noise.
        noise: factor on the sensors' noise.
        variation: relative standard deviation of what differs from trial to trial.
        forces: whether muscle forces are measured.
        quantised: whether angle and pressures come in steps of the rig's encoder and converter.
        measured_drive: True records no commands: the measured pressures then drive the rig.
        seed: random seed.

    Raises:
        InputError: for no repeats, a duration of too few samples or without end, or a factor or
            seed below 0.
    """

    protocols: tuple[str, ...] = ()
    repeats: int = 4
    duration: float | None = None
    coloured: bool = False
    noise: float = 1.0
    variation: float = 0.003
    forces: bool = True
    quantised: bool = False
    measured_drive: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        if self.repeats < 1:
            raise InputError(f"{self.repeats} repeats: at least one trial is needed")
        least = FEWEST_ROWS / RATE
        if self.duration is not None and not least <= self.duration < math.inf:
            raise InputError(
                f"`duration` is {self.duration:g} s; a trial needs a finite time of {least:g} s or"
                " more"
            )
        for name in ("noise", "variation", "seed"):
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise InputError(f"`{name}` is {value:g}; it must be 0 or above")


@dataclass(frozen=True, kw_only=True)
class HiddenEffect:
    """One effect that was hidden."""

    name: str  # of the effect
    size: float  # how much of it [unit]
    unit: str  # of the size
    stands_for: tuple[str, ...]  # effects of the library that are right names for it
    families: tuple[str, ...] = ()  # families of the library that are right for it


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
        hidden = " + ".join(f"{e.name} ({e.size:g} {e.unit})" for e in self.effects) or "no effect"
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

        The recording names the rig without the effects. Nothing that reads the folder, which is
        made if need be, can read the ground truth, ``<folder>.ground_truth.json``, whose path is
        returned.

        Raises:
            InputError: if the folder cannot be written.
        """
        folder = Path(folder)
        refuse_file(folder)
        write_recording(
            folder, self.reference, self.trials, self.protocols, forces=self.settings.forces
        )
        file = ground_truth_file(folder)
        write_json(file, self.to_dict())
        return file
