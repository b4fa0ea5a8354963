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
from tests.unit.core.refusals import cases, refused

SHIPPED = sorted(path.parent.name for path in shipped_rigs().glob("*/params.toml"))


def leaves(table: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Every number table, and every other value, of a TOML file."""
    if isinstance(table, dict) and "value" not in table:
        for name, entry in table.items():
            yield from leaves(entry, f"{key}.{name}" if key else name)
    else:
        yield key, table


# --- the rigs that are shipped ------------------------------------------------------------------


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_number_has_a_source_and_a_unit(name):
    table = tomllib.loads((find_rig(name) / "params.toml").read_text(encoding="utf-8"))
    numbers = 0
    for key, leaf in leaves(table):
        if isinstance(leaf, dict):
            numbers += 1
            assert str(leaf.get("source", "")).strip(), f"{key} has no source"
            to_si(leaf["value"], leaf["unit"], leaf["unit"], where=key)
            for pair in (leaf.get("interval95"), leaf.get("bounds")):
                assert pair is None or pair[0] <= leaf["value"] <= pair[1], key
        else:
            words = leaf if isinstance(leaf, list) else [leaf]
            assert all(isinstance(word, str) for word in words), f"{key} = {leaf!r} has no source"
    assert numbers > 20


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_rig_makes_muscles_and_sensors(name):
    rig = read_rig(name)
    assert rig.name == name
    assert len(rig.tendons) >= 1
    for muscle in rig.tendons:
        own = rig.overrides[muscle]
        stated = {
            group: {**rig.muscle.get(group, {}), **own.get(group, {})}
            for group in {*rig.muscle, *own}
        }
        assert build_muscle(stated, where=name).valve.supply_pressure > 0.0
    if rig.sensor:
        units = {key: spec.unit for key, spec in specs(MeasurementChain)}
        values = {key: entry.si(units[key]) for key, entry in rig.sensor.items()}
        assert MeasurementChain(**values).pressure_step > 0.0


# --- a good file --------------------------------------------------------------------------------


def test_everything_in_a_file_is_read(rig_folder):
    folder = rig_folder()
    rig = read_rig(folder)
    assert (rig.name, rig.joints, rig.load_body) == ("toy", ("shaft",), "load")
    assert rig.mjcf == folder / "toy.xml"
    assert rig.scene == folder / "scene.xml"
    assert list(rig.tendons.items()) == [("left", "tendon_1"), ("right", "tendon_2")]
    assert rig.muscle["force"]["law"] == "ideal_mckibben"
    scale = rig.muscle["force"]["scale"]
    assert (scale.value, scale.unit, scale.source) == (0.9, "1", "identified")
    assert scale.interval95 == (0.8, 1.0)
    assert rig.overrides["left"] == {}
    assert rig.overrides["right"]["braid"]["diameter"].si("m") == pytest.approx(0.021)
    assert rig.native["joint.shaft.damping"].note == "a guess"
    assert rig.sensor["converter_bits"].bounds == (12.0, 16.0)
    where = rig.muscle["braid"]["diameter"].where
    assert str(folder / "params.toml") in where
    assert "muscle.braid.diameter" in where
    plain = rig.muscle["braid"]["diameter"]
    assert (plain.interval95, plain.bounds, plain.note) == (None, None, "")


def test_a_file_may_leave_out_scene_and_load(rig_folder):
    rig = read_rig(rig_folder('scene = "scene.xml"\nangle_joint = "shaft"\nload_body = "load"', ""))
    assert (rig.scene, rig.joints, rig.load_body) == (None, (), None)


# --- broken files: old piece, new piece, words of the refusal -----------------------------------

DIAMETER = '{ value = 20, unit = "mm", source = "Table 1" }'
BROKEN = {
    "wrong schema": ("pamsim-rig/1", "pamsim-rig/9", ("'pamsim-rig/9'", "'pamsim-rig/1'")),
    "unknown table": ("[sensor]", "[sensors]", ("sensors", "did you mean 'sensor'")),
    "unknown key of the rig": (
        "angle_joint",
        "angle_joints",
        ("[rig]", "unknown key angle_joints", "did you mean 'angle_joint'"),
    ),
    "unknown key of a number": (
        DIAMETER,
        '{ value = 20, units = "mm", source = "Table 1" }',
        ("muscle.braid.diameter", "unknown key units", "did you mean 'unit'"),
    ),
    "two ways to name joints": (
        'angle_joint = "shaft"',
        'angle_joint = "shaft"\njoints = ["shaft"]',
        ("angle_joint and joints", "keep one"),
    ),
    "a joint twice": ('angle_joint = "shaft"', 'joints = ["a", "a"]', ("joints", "once")),
    "no joint": ('angle_joint = "shaft"', "joints = []", ("joints", "once")),
    "no tendon": ('{ tendon = "tendon_1" }', "{}", ("muscles.left", "tendon")),
    "tendon is a number": ('"tendon_1"', "1", ("muscles.left", "tendon")),
    "muscle is a word": ('{ tendon = "tendon_1" }', '"tendon_1"', ("muscles.left",)),
    "override is a word": ('{ tendon = "tendon_1" }', '{ tendon = "t", x = 1 }', ("left.x",)),
    "value is a word": ("value = 20", 'value = "20"', ("muscle.braid.diameter", "value = '20'")),
    "no source": (DIAMETER, '{ value = 20, unit = "mm" }', ("muscle.braid.diameter", "source")),
    "bare number": (DIAMETER, "20", ("muscle.braid.diameter", "value = ", "source = ")),
    "bare native number": (
        '{ value = 1, unit = "N*m*s/rad", source = "assumed", note = "a guess" }',
        "1",
        ("native.joint.shaft.damping",),
    ),
    "range the wrong way": ("[0.8, 1.0]", "[1.0, 0.8]", ("muscle.force.scale", "[1.0, 0.8]")),
    "range of three": ("[12, 16]", "[12, 14, 16]", ("sensor.converter_bits", "[12, 14, 16]")),
    "range of mixed": ("[12, 16]", '[12, "16"]', ("sensor.converter_bits", "'16'")),
    "mjcf not there": ('"toy.xml"', '"toys.xml"', ("'toys.xml'",)),
    "scene not there": ('"scene.xml"', '"dark.xml"', ("'dark.xml'",)),
}


@pytest.mark.parametrize(("old", "new", "words"), cases(BROKEN))
def test_broken_file_is_refused_with_file_and_key(rig_folder, old, new, words):
    folder = rig_folder(old, new)
    with refused(str(folder / "params.toml"), *words):
        read_rig(folder)


@pytest.mark.parametrize("table", ["rig", "muscles", "muscle", "native", "sensor"])
@pytest.mark.parametrize("instead", ["", "3", '"word"'])
def test_a_missing_or_flat_table_is_asked_for(rig_folder, table, instead):
    path = rig_folder() / "params.toml"
    schema, *parts = re.split(r"\n(?=\[)", path.read_text(encoding="utf-8"))
    kept = [part for part in parts if re.match(r"\[(\w+)", part)[1] != table]
    flat = [f"{table} = {instead}"] if instead else []
    path.write_text("\n".join([schema, *flat, *kept]), encoding="utf-8")
    if table in ("native", "sensor") and not instead:
        assert not getattr(read_rig(path.parent), table)
        return
    with refused(str(path), f"[{table}]"):
        read_rig(path.parent)


def test_a_folder_without_params_and_an_unknown_name_are_refused(tmp_path: Path):
    with refused(str(tmp_path), "params.toml"):
        read_rig(tmp_path)
    with refused("'mas20_arms'", "did you mean 'mas20_arm'"):
        find_rig("mas20_arms")
    assert find_rig("mas20_arm") == shipped_rigs() / "mas20_arm"
    assert find_rig(shipped_rigs() / "mas20_arm") == shipped_rigs() / "mas20_arm"


def test_wrong_unit_is_refused_with_file_and_key(rig_folder):
    folder = rig_folder('"mm", source = "Table 1"', '"kPa", source = "Table 1"')
    diameter = read_rig(folder).muscle["braid"]["diameter"]
    with refused(str(folder / "params.toml"), "muscle.braid.diameter", "'kPa'", "does not measure"):
        diameter.si("m")
