"""Rig files: what is read from a good one, and the message for a broken one."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pamsim.core.parameters import specs
from pamsim.core.units import to_si
from pamsim.physics.muscle import build_muscle
from pamsim.recordings.rig_file import find_rig, read_rig, shipped_rigs
from pamsim.recordings.sensors import MeasurementChain
from tests.unit.core.refusals import all_refused, refused

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
def toy(tmp_path):
    """Read the toy rig, with one piece of its ``params.toml`` replaced."""
    for name in ("toy.xml", "scene.xml"):
        (tmp_path / name).write_text("<mujoco/>", encoding="utf-8")

    def read(old="", new=""):
        assert old in PARAMS, f"{old!r} is no longer part of the toy rig"
        text = PARAMS.replace(old, new, 1) if old else PARAMS
        (tmp_path / "params.toml").write_text(text, encoding="utf-8")
        return read_rig(tmp_path)

    return read


def leaves(table: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Every number table, and every other value, of a TOML file."""
    if isinstance(table, dict) and "value" not in table:
        for name, entry in table.items():
            yield from leaves(entry, f"{key}.{name}" if key else name)
    else:
        yield key, table


@pytest.mark.parametrize(
    "name", sorted(path.parent.name for path in shipped_rigs().glob("*/params.toml"))
)
def test_every_shipped_rig_makes_muscles_from_numbers_with_source_and_unit(name):
    table = tomllib.loads((find_rig(name) / "params.toml").read_text(encoding="utf-8"))
    found = dict(leaves(table))
    numbers = {key: leaf for key, leaf in found.items() if isinstance(leaf, dict)}
    assert len(numbers) > 20
    for key, leaf in numbers.items():
        assert str(leaf.get("source", "")).strip(), f"{key} has no source"
        to_si(leaf["value"], leaf["unit"], leaf["unit"], where=key)
        for pair in (leaf.get("interval95"), leaf.get("bounds")):
            assert pair is None or pair[0] <= leaf["value"] <= pair[1], key
    for key in found.keys() - numbers.keys():
        words = found[key] if isinstance(found[key], list) else [found[key]]
        assert all(isinstance(word, str) for word in words), f"{key} has no source"
    rig = read_rig(name)
    assert rig.name == name
    for muscle in rig.tendons:
        own = rig.overrides[muscle]
        groups = {*rig.muscle, *own}
        stated = {group: rig.muscle.get(group, {}) | own.get(group, {}) for group in groups}
        assert build_muscle(stated, where=name).valve.supply_pressure > 0.0
    if rig.sensor:
        units = {key: spec.unit for key, spec in specs(MeasurementChain)}
        values = {key: entry.si(units[key]) for key, entry in rig.sensor.items()}
        assert MeasurementChain(**values).pressure_step > 0.0


def test_everything_in_a_file_is_read(toy, tmp_path):
    rig = toy()
    assert (rig.name, rig.joints, rig.load_body) == ("toy", ("shaft",), "load")
    assert (rig.mjcf, rig.scene) == (tmp_path / "toy.xml", tmp_path / "scene.xml")
    assert list(rig.tendons.items()) == [("left", "tendon_1"), ("right", "tendon_2")]
    assert rig.muscle["force"]["law"] == "ideal_mckibben"
    scale = rig.muscle["force"]["scale"]
    assert (scale.value, scale.unit, scale.source) == (0.9, "1", "identified")
    assert scale.interval95 == (0.8, 1.0)
    assert rig.overrides["left"] == {}
    assert rig.overrides["right"]["braid"]["diameter"].si("m") == pytest.approx(0.021)
    assert rig.native["joint.shaft.damping"].note == "a guess"
    assert rig.sensor["converter_bits"].bounds == (12.0, 16.0)
    plain = rig.muscle["braid"]["diameter"]
    assert (plain.interval95, plain.bounds, plain.note) == (None, None, "")
    with refused(str(tmp_path / "params.toml"), "muscle.braid.diameter", "does not measure"):
        plain.si("Pa")
    bare = toy('scene = "scene.xml"\nangle_joint = "shaft"\nload_body = "load"', "")
    assert (bare.scene, bare.joints, bare.load_body) == (None, (), None)


DIAMETER = '{ value = 20, unit = "mm", source = "Table 1" }'
DAMPING = '{ value = 1, unit = "N*m*s/rad", source = "assumed", note = "a guess" }'
JOINT, TENDON = 'angle_joint = "shaft"', '{ tendon = "tendon_1" }'
PLACE = "muscle.braid.diameter"
BROKEN = {  # old piece, new piece, words of the refusal
    "wrong schema": ("pamsim-rig/1", "pamsim-rig/9", ("'pamsim-rig/9'", "'pamsim-rig/1'")),
    "unknown table": ("[sensor]", "[sensors]", ("sensors", "did you mean 'sensor'")),
    "key of the rig": ("angle_joint", "angle_joints", ("[rig]", "did you mean 'angle_joint'")),
    "key of a number": (DIAMETER, DIAMETER.replace("unit", "units"), (PLACE, "mean 'unit'")),
    "two ways to name joints": (JOINT, JOINT + '\njoints = ["shaft"]', "keep one"),
    "a joint twice": (JOINT, 'joints = ["a", "a"]', ("joints", "once")),
    "no joint": (JOINT, "joints = []", ("joints", "once")),
    "no tendon": (TENDON, "{}", ("muscles.left", "tendon")),
    "tendon is a number": ('"tendon_1"', "1", ("muscles.left", "tendon")),
    "muscle is a word": (TENDON, '"tendon_1"', "muscles.left"),
    "override is a word": (TENDON, '{ tendon = "t", x = 1 }', "left.x"),
    "value is a word": ("value = 20", 'value = "20"', (PLACE, "value = '20'")),
    "no source": (DIAMETER, '{ value = 20, unit = "mm" }', (PLACE, "source")),
    "bare number": (DIAMETER, "20", (PLACE, "value = ", "source = ")),
    "bare native number": (DAMPING, "1", "native.joint.shaft.damping"),
    "range the wrong way": ("[0.8, 1.0]", "[1.0, 0.8]", ("muscle.force.scale", "[1.0, 0.8]")),
    "range of three": ("[12, 16]", "[12, 14, 16]", ("sensor.converter_bits", "[12, 14, 16]")),
    "range of mixed": ("[12, 16]", '[12, "16"]', ("sensor.converter_bits", "'16'")),
    "no name of the load": ('load_body = "load"', 'load_body = ""', "load_body = ''; write"),
    "mjcf not there": ('"toy.xml"', '"toys.xml"', "'toys.xml'"),
    "scene not there": ('"scene.xml"', '"dark.xml"', "'dark.xml'"),
}


def test_a_broken_file_is_refused_with_file_and_key(toy, tmp_path):
    with refused(str(tmp_path), "params.toml"):
        read_rig(tmp_path)  # nothing is there yet
    all_refused(BROKEN, toy, str(tmp_path / "params.toml"))


def test_a_missing_or_flat_table_is_asked_for(toy, tmp_path):
    toy()
    schema, *parts = re.split(r"\n(?=\[)", PARAMS)
    path = tmp_path / "params.toml"
    for table in ("rig", "muscles", "muscle", "native", "sensor"):
        kept = [part for part in parts if re.match(r"\[(\w+)", part)[1] != table]
        for flat in ([], [f"{table} = 3"], [f'{table} = "word"']):
            path.write_text("\n".join([schema, *flat, *kept]), encoding="utf-8")
            if table in ("native", "sensor") and not flat:
                assert not getattr(read_rig(tmp_path), table)
            else:
                with refused(str(path), f"[{table}]"):
                    read_rig(tmp_path)


def test_a_rig_is_found_by_name_and_by_folder():
    with refused("'mas20_arms'", "did you mean 'mas20_arm'"):
        find_rig("mas20_arms")
    with refused("arm.xml: an MJCF alone is no rig", "--mjcf arm.xml"):
        find_rig("arm.xml")
    folder = shipped_rigs() / "mas20_arm"
    assert find_rig("mas20_arm") == find_rig(folder) == folder


def test_a_folder_that_is_called_as_a_shipped_rig_is_not_taken_for_it(tmp_path, monkeypatch):
    """Its `effects.py` would run in every command that leaves its rig out."""
    own = tmp_path / "mas20_arm"
    own.mkdir()
    (own / "params.toml").write_text("")
    monkeypatch.chdir(tmp_path)
    with refused("a shipped rig and a folder here: write './mas20_arm'"):
        find_rig("mas20_arm")
    for named in ("./mas20_arm", Path("mas20_arm"), own):
        assert find_rig(named) == own
        assert find_rig(str(find_rig(named))) == own  # as jobs pass it on
    assert find_rig("muscle_bench") == shipped_rigs() / "muscle_bench"
    monkeypatch.chdir(shipped_rigs())
    assert find_rig("mas20_arm").samefile(shipped_rigs() / "mas20_arm")
