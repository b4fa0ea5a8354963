"""A small rig folder to break."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

PARAMS = """\
schema = "pamsim-rig/1"

[rig]
name = "toy"
mjcf = "toy.xml"
scene = "scene.xml"
angle_joint = "shaft"
load_body = "load"

[muscles]
left = { tendon = "tendon_1" }

[muscles.right]
tendon = "tendon_2"
[muscles.right.braid]
diameter = { value = 21, unit = "mm", source = "measured" }

[muscle.braid]
diameter = { value = 20, unit = "mm", source = "Table 1" }

[muscle.force]
law = "ideal_mckibben"
scale = { value = 0.9, unit = "1", source = "identified", interval95 = [0.8, 1.0] }

[native]
"joint.shaft.damping" = { value = 1, unit = "N*m*s/rad", source = "assumed", note = "a guess" }

[sensor]
converter_bits = { value = 14, unit = "1", source = "Table 2", bounds = [12, 16] }
"""


@pytest.fixture
def rig_folder(tmp_path: Path) -> Callable[..., Path]:
    """Write the toy rig, with one piece of its ``params.toml`` replaced, and return its folder."""

    def write(old: str = "", new: str = "") -> Path:
        assert old in PARAMS, f"{old!r} is no longer part of the toy rig"
        folder = tmp_path / "toy"
        folder.mkdir()
        text = PARAMS.replace(old, new, 1) if old else PARAMS
        (folder / "params.toml").write_text(text, encoding="utf-8")
        for name in ("toy.xml", "scene.xml"):
            (folder / name).write_text("<mujoco/>", encoding="utf-8")
        return folder

    return write
