"""Rig files: what is read from a good one, and the message for a broken one."""

from __future__ import annotations

import dataclasses
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


def test_the_papers_rig_is_shipped():
    assert "mas20_arm" in SHIPPED


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


def test_a_file_may_leave_out_scene_load_native_and_sensor(rig_folder):
    folder = rig_folder('scene = "scene.xml"\n', "", without="scene.xml")
    text = (folder / "params.toml").read_text(encoding="utf-8").replace('load_body = "load"\n', "")
    (folder / "params.toml").write_text(text[: text.index("[native]")], encoding="utf-8")
    rig = read_rig(folder)
    assert (rig.scene, rig.load_body) == (None, None)
    assert dict(rig.native) == dict(rig.sensor) == {}


def test_numbers_without_extras_have_none(rig_folder):
    number = read_rig(rig_folder()).muscle["braid"]["diameter"]
    plain = {f.name: getattr(number, f.name) for f in dataclasses.fields(number)}
    assert (plain["interval95"], plain["bounds"], plain["note"]) == (None, None, "")


# --- broken files: old piece, new piece, words of the refusal -----------------------------------

DIAMETER = '{ value = 20, unit = "mm", source = "Table 1" }'
BROKEN = {
    "bad TOML": ("[rig]", "[rig", ("not valid TOML",)),
    "wrong schema": ("pamsim-rig/1", "pamsim-rig/9", ("'pamsim-rig/9'", "'pamsim-rig/1'")),
    "no schema": ('schema = "pamsim-rig/1"', "", ("schema",)),
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
    "no name": ('name = "toy"\n', "", ("[rig]", "name")),
    "two ways to name joints": (
        'angle_joint = "shaft"',
        'angle_joint = "shaft"\njoints = ["shaft"]',
        ("angle_joint and joints", "keep one"),
    ),
    "a joint twice": ('angle_joint = "shaft"', 'joints = ["a", "a"]', ("joints", "once")),
    "no joint": ('angle_joint = "shaft"', "joints = []", ("joints", "once")),
    "joint is a number": ('angle_joint = "shaft"', "angle_joint = 3", ("[rig]", "angle_joint")),
    "no tendon": ('{ tendon = "tendon_1" }', "{}", ("muscles.left", "tendon")),
    "tendon is a number": ('"tendon_1"', "1", ("muscles.left", "tendon")),
    "muscle is a word": ('{ tendon = "tendon_1" }', '"tendon_1"', ("muscles.left",)),
    "override is a word": ('{ tendon = "tendon_1" }', '{ tendon = "t", x = 1 }', ("left.x",)),
    "no value": (
        DIAMETER,
        '{ unit = "mm", source = "Table 1" }',
        ("muscle.braid.diameter", "value = 12.5"),
    ),
    "value is a word": ("value = 20", 'value = "20"', ("muscle.braid.diameter", "value = '20'")),
    "value is a boolean": ("value = 20", "value = true", ("muscle.braid.diameter", "value = True")),
    "no unit": (
        DIAMETER,
        '{ value = 20, source = "Table 1" }',
        ("muscle.braid.diameter", "unit"),
    ),
    "no source": (DIAMETER, '{ value = 20, unit = "mm" }', ("muscle.braid.diameter", "source")),
    "empty source": (
        DIAMETER,
        '{ value = 20, unit = "mm", source = " " }',
        ("muscle.braid.diameter", "source"),
    ),
    "bare number": (DIAMETER, "20", ("muscle.braid.diameter", "value = ", "source = ")),
    "bare native number": (
        '{ value = 1, unit = "N*m*s/rad", source = "assumed", note = "a guess" }',
        "1",
        ("native.joint.shaft.damping",),
    ),
    "range the wrong way": ("[0.8, 1.0]", "[1.0, 0.8]", ("muscle.force.scale", "[1.0, 0.8]")),
    "range of three": ("[12, 16]", "[12, 14, 16]", ("sensor.converter_bits", "[12, 14, 16]")),
    "range of words": ("[12, 16]", '["12", "16"]', ("sensor.converter_bits", "'12'")),
    "range of mixed": ("[12, 16]", '[12, "16"]', ("sensor.converter_bits", "'16'")),
    "mjcf not there": ('"toy.xml"', '"toys.xml"', ("'toys.xml'",)),
}


@pytest.mark.parametrize(("old", "new", "words"), cases(BROKEN))
def test_broken_file_is_refused_with_file_and_key(rig_folder, old, new, words):
    folder = rig_folder(old, new)
    with refused(str(folder / "params.toml"), *words):
        read_rig(folder)


@pytest.mark.parametrize("table", ["rig", "muscles", "muscle"])
@pytest.mark.parametrize("instead", ["", "3", '"word"'])
def test_missing_or_flat_table_is_asked_for(rig_folder, table, instead):
    folder = rig_folder()
    path = folder / "params.toml"
    lines = path.read_text(encoding="utf-8").splitlines()
    kept: list[str] = []
    inside = False
    for line in lines:
        if line.startswith("["):
            inside = line.strip("[]").partition(".")[0] == table
        if not inside:
            kept.append(line)
    if instead:
        kept.insert(1, f"{table} = {instead}")
    path.write_text("\n".join(kept), encoding="utf-8")
    with refused(str(path), f"[{table}]"):
        read_rig(folder)


@pytest.mark.parametrize("table", ["native", "sensor"])
def test_flat_optional_table_is_refused(rig_folder, table):
    folder = rig_folder()
    path = folder / "params.toml"
    text = path.read_text(encoding="utf-8")
    text = text[: text.index("[native]")].replace("\n\n", f"\n{table} = 3\n\n", 1)
    path.write_text(text, encoding="utf-8")
    with refused(str(path), table):
        read_rig(folder)


@pytest.mark.parametrize("name", ["toy.xml", "scene.xml"])
def test_missing_model_file_is_named(rig_folder, name):
    folder = rig_folder(without=name)
    with refused(str(folder / "params.toml"), repr(name)):
        read_rig(folder)


def test_file_that_is_no_text_is_refused(rig_folder):
    folder = rig_folder()
    (folder / "params.toml").write_bytes(b'schema = "\xff\xfe"')
    with refused(str(folder / "params.toml")):
        read_rig(folder)


def test_a_folder_without_params_and_an_unknown_name_are_refused(tmp_path: Path):
    with refused(str(tmp_path), "params.toml"):
        read_rig(tmp_path)
    with refused("'mas20_arms'", "did you mean 'mas20_arm'"):
        find_rig("mas20_arms")
    assert find_rig("mas20_arm") == shipped_rigs() / "mas20_arm"
    assert find_rig(shipped_rigs() / "mas20_arm") == shipped_rigs() / "mas20_arm"


@pytest.mark.parametrize(
    ("written", "words"),
    [
        ('"kPa"', ("muscle.braid.diameter", "'kPa'", "does not measure")),
        ('"millimetres long"', ("muscle.braid.diameter", "'millimetres long'", "not known")),
    ],
)
def test_wrong_unit_is_refused_with_file_and_key(rig_folder, written, words):
    folder = rig_folder('"mm", source = "Table 1"', f'{written}, source = "Table 1"')
    diameter = read_rig(folder).muscle["braid"]["diameter"]
    with refused(str(folder / "params.toml"), *words):
        diameter.si("m")
