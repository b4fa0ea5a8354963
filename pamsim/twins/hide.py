"""``pamsim hide``: twin recordings with hidden effects on disk, the truth in a file apart."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pamsim.core.errors import InputError
from pamsim.core.recording import write_recording
from pamsim.effects.catalog import EFFECTS
from pamsim.engine.rig import load_rig
from pamsim.engine.rig_parameter import rig_parameter
from pamsim.store.json_file import write_json
from pamsim.twins.independent_models.catalog import OUTSIDE
from pamsim.twins.twin_data import TwinSettings, twin_data

NOTHING = "none"
"""Stands for no effect."""


def hide(
    effects: Sequence[tuple[str, float]],
    out: Path,
    *,
    rig: str | os.PathLike[str] = "mas20_arm",
    settings: TwinSettings | None = None,
) -> dict[str, Any]:
    """Write a recording of a rig in which effects are hidden.

    The recording names the rig without the effects. What was hidden is written beside the folder,
    not into it, so that nothing that reads the recording can read it.

    Args:
        effects: names, of the library or from outside, and sizes in units of the typical one.
        out: folder of the recording.
        rig: name or folder of the rig without effects.
        settings: see `TwinSettings`.

    Returns:
        The truth, as written.

    Raises:
        InputError: see `twin_data`; or a folder that cannot be written.
    """
    chosen = settings or TwinSettings()
    base = load_rig(rig)
    data = twin_data(base, effects, chosen)
    if out.exists() and not out.is_dir():
        raise InputError(f"{out} is a file; name a folder to write into")
    write_recording(out, str(rig), data.trials, data.protocols, forces=chosen.forces)
    truth: dict[str, Any] = {
        "schema": "pamsim-truth/1",
        "rig": base.name,
        "effects": [_told(name, size, chosen.tier, data.formulations) for name, size in effects],
        "parameters": {
            name: {"value_si": value, "unit_si": rig_parameter(base, name).spec.unit}
            for name, value in data.hidden.items()
        },
        "settings": asdict(chosen),
        "trials": len(data.trials),
    }
    write_json(truth_file(out), truth)
    return truth


def _told(name: str, size: float, tier: str, formulations: Mapping[str, str]) -> dict[str, Any]:
    inside = name in EFFECTS
    return {
        "name": name,
        "size": size,
        "tier": tier if inside else "outside",
        "formulation": formulations.get(name, "as in the library"),
        "span": [name] if inside else list(OUTSIDE[name].span),
    }


def truth_file(out: Path) -> Path:
    """Where the truth of a recording is kept: beside its folder."""
    return out.parent / f"{out.name}.truth.json"
