"""``pamsim list rigs`` and ``params``: the shipped rigs, and every parameter of a rig."""

from __future__ import annotations

import os
from typing import Any

from pamsim.core.encoding import to_dict
from pamsim.engine.parameters import rig_parameter, rig_parameters
from pamsim.engine.rig import Rig, load_rig
from pamsim.recordings.rig_file import shipped_rig_names, shipped_rigs
from pamsim.recordings.signals import JOINT_DRIVES, MUSCLE_DRIVES


def rig_cards(name: str | os.PathLike[str] | None = None) -> dict[str, Any]:
    """Describe the shipped rigs, or one rig.

    Args:
        name: of a shipped rig, or a rig folder; None for all shipped ones.

    Returns:
        JSON-safe mapping ``rigs``: name, purpose, folder, joints with ranges [rad or m], muscles
        with laws and supply pressure [Pa], body that carries a load, drives with their meaning.

    Raises:
        InputError: for an unknown rig, or a bad file.
    """
    rigs = [shipped_rigs() / one for one in shipped_rig_names()] if name is None else [name]
    return to_dict({"schema": "pamsim-rigs/1", "rigs": [_card(load_rig(one)) for one in rigs]})


def parameter_cards(
    name: str | None = None, rig: str | os.PathLike[str] = "mas20_arm"
) -> dict[str, Any]:
    """Describe all parameters of a rig, or one.

    Args:
        name: as `Rig.with_parameters` takes it; None for all.
        rig: name of a shipped rig, or a rig folder.

    Returns:
        JSON-safe mapping ``parameters``: name, value and range in SI, unit, meaning, source, and
        what ``params.toml`` states in its own unit (``stated``, None for a default or a number of
        the MJCF).

    Raises:
        InputError: for an unknown parameter, with the nearest, or an unknown rig.
    """
    loaded = load_rig(rig)
    found = rig_parameters(loaded) if name is None else [rig_parameter(loaded, name)]
    return to_dict({"schema": "pamsim-params/1", "rig": loaded.name, "parameters": list(found)})


def _card(rig: Rig) -> dict[str, Any]:
    joints = [
        {"name": name, "kind": kind, "range": joint.range if joint.limited[0] else None}
        for name, kind in rig.joints.items()
        for joint in [rig.model.joint(name)]
    ]
    return {
        "name": rig.name,
        "purpose": rig.file.purpose,
        "folder": rig.file.folder,
        "joints": joints,
        "muscles": [
            {
                "name": name,
                "force": muscle.force.law,
                "hysteresis": muscle.hysteresis.law if muscle.hysteresis else None,
                "supply_pressure": muscle.valve.supply_pressure,
            }
            for name, muscle in rig.muscles.items()
        ],
        "load_body": rig.file.load_body,
        "drives": {
            "muscles": {name: kind.meaning for name, kind in MUSCLE_DRIVES.items()},
            "joints": {
                name: drive.meaning
                for name, drive in JOINT_DRIVES.items()
                if drive.of in rig.joints.values()
            },
        },
    }
