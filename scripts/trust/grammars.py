"""Files that keep to the grammar of their format, with contents that nobody meant.

`readers.py` spoils good files; these are well-formed TOML, CSV, XML, arrays and quantities, whose
keys, types, sizes and numbers are drawn: most are ones that the format knows, some are not.
"""

from __future__ import annotations

import csv
import io
import json
import tomllib
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import scipy.io
from pyarrow import parquet

from pamsim.physics.force_laws.catalog import FORCE_LAWS
from pamsim.physics.hysteresis.catalog import OPERATORS
from pamsim.recordings.rig_file import shipped_rigs

Draw = np.random.Generator

POLICY = Path(__file__).parents[1] / "results" / "policy_step.npz"
"""A good policy."""

EDGES = (0, 1, -1, 2, 0.1, -0.0, 1e-320, 5e-324, 1e-12, 1e12, 1e300, -1e300, 2**31, 2**63, 10**40)
"""Numbers at which arithmetic changes."""
WORDS = (
    "", " ", "a", "time", "time_s", "mas20_arm", "muscle_1", "shaft", "on", "nan", "inf", "1e5",
    "..", "../..", "/", "~", "con", "\u00e9", "\u202e", "\\", '"', "'", "#", "%s", "{}", "$x$",
    "x" * 300, "0.1 s", "5 kPa", "1/0", "10**9 s", "-1 Hz", "1e400 s", "2 furlong",
)  # fmt: skip
UNITS = (
    "", "s", "ms", "min", "Pa", "kPa", "bar", "psi", "psia", "mbar", "deg", "rad", "mm", "m", "N",
    "N*m", "1", "K", "furlong", "m^2", "m^-3", "kg*m^2", "1/s", "mm^3/(s*kPa)", "m**9**9", "(",
    "m/0", "10*s",
)  # fmt: skip
SIGNALS = (
    "time_s", "p1_kpa", "p2_kpa", "p1_set_kpa", "p2_set_kpa", "u1", "u2", "angle_deg", "force1_n",
    "force2_n", "load_kg", "p3_kpa", "p1_bar", "beta_deg", "shaft_deg", "muscle_1_kpa", "t_ms",
    "note", "start_p1_kpa", "contraction", "force_n", "length_mm", "branch", "p_kpa", "loop",
    "displacement_mm", "p1000000_kpa", "force1000000000_n",
)  # fmt: skip


def _pick(rng: Draw, some: Sequence[Any]) -> Any:
    return some[int(rng.integers(len(some)))]


def number(rng: Draw) -> float | int:
    """A number of any size, often a plain one."""
    match int(rng.integers(4)):
        case 0:
            return _pick(rng, EDGES)
        case 1:
            return int(rng.integers(-5, 50))
        case 2:
            return float(rng.uniform(-1.0, 1.0))
        case _:
            return float(rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(-12.0, 12.0))


def value(rng: Draw, depth: int = 2) -> Any:
    """Any value that TOML and JSON can hold."""
    kind = int(rng.integers(7 if depth else 4))
    if kind < 2:
        return number(rng) if rng.random() < 0.95 else 10**400
    if kind < 4:
        return _pick(rng, WORDS) if kind == 2 else bool(rng.integers(2))
    if kind < 6:
        return [value(rng, depth - 1) for _ in range(int(rng.integers(4)))]
    return {_pick(rng, WORDS) or "k": value(rng, depth - 1) for _ in range(int(rng.integers(4)))}


def _toml(one: Any) -> str:
    if isinstance(one, Mapping):
        inside = (f"{json.dumps(str(k), ensure_ascii=False)} = {_toml(v)}" for k, v in one.items())
        return "{ " + ", ".join(inside) + " }"
    if isinstance(one, list):
        return f"[{', '.join(map(_toml, one))}]"
    return repr(one) if isinstance(one, float) else json.dumps(one, ensure_ascii=False)


def _tables(one: Mapping[str, Any]) -> bytes:
    return "\n".join(f"{json.dumps(k)} = {_toml(v)}" for k, v in one.items()).encode()


def _some(
    rng: Draw, keys: Mapping[str, Callable[[Draw], Any]], rest: float = 0.05
) -> dict[str, Any]:
    """Some of the keys that a table may have, each with a value of its kind, seldom of another."""
    found = {k: (value if rng.random() < rest else own)(rng) for k, own in keys.items()}
    left = {k: v for k, v in found.items() if rng.random() > rest}
    return left | ({_pick(rng, WORDS) or "k": value(rng)} if rng.random() < rest else {})


def _seconds(rng: Draw) -> Any:
    return _pick(rng, (f"{number(rng):g} s", number(rng), "2 s", "0.1 s", "50 ms"))


def recording(rng: Draw) -> bytes:
    """A ``recording.toml`` beside a ``step.csv`` of the arm."""

    def column(rng: Draw) -> Any:
        keys: dict[str, Callable[[Draw], Any]] = {
            "column": lambda r: _pick(r, ("time_s", "p1_kpa", "p2_kpa", "angle_deg", "no_such")),
            "unit": lambda r: _pick(r, UNITS),
            "sign": lambda r: _pick(r, (1, -1, 0)),
            "offset": number,
            "absolute": lambda r: bool(r.integers(2)),
            "times": lambda r: f"{number(r):g} {_pick(r, UNITS)}",
            "wraps": number,
            "rate": lambda r: f"{number(r):g} Hz",
        }
        few = {k: keys[k] for k in list(keys)[:2]}
        return _some(rng, few | {k: v for k, v in keys.items() if rng.random() < 0.15})

    def trial(rng: Draw) -> Any:
        keys: dict[str, Callable[[Draw], Any]] = {
            "file": lambda r: _pick(r, (*["step.csv"] * 9, "./step.csv", "no.csv", "..", "")),
            "protocol": lambda r: _pick(r, WORDS) or "step",
            "drive": lambda r: _pick(
                r, ("pressure_set", "valve", "pulse", "measured", "sealed", {"muscle_1": "valve"})
            ),
            "load_kg": lambda r: _pick(r, (0, 1.2, 1.2, abs(number(r)))),
        }
        more: dict[str, Callable[[Draw], Any]] = {
            "period": _seconds,
            "lead_in": _seconds,
            "rate": lambda r: f"{number(r):g} Hz",
            "segments": lambda r: [[number(r), number(r)] for _ in range(int(r.integers(3)))],
        }
        return _some(rng, keys | {k: v for k, v in more.items() if rng.random() < 0.2})

    own = rng.random() < 0.5
    names = (
        "time", "angle", "pressure_1", "pressure_set_1", "muscle_2.pressure", "shaft.angle",
        "valve_2",
    )  # fmt: skip
    top: dict[str, Any] = {
        "schema": f"pamsim-recording/{2 if own else 1}",
        "rig": _pick(rng, (*["mas20_arm"] * 9, "two_joint_arm", ".", "")),
        "trial": [trial(rng) for _ in range(int(rng.integers(1, 4)))],
    }
    if own:
        top["columns"] = {n: column(rng) for n in names if n == "time" or rng.random() < 0.6}
    if rng.random() < 0.3:
        top["noise"] = {
            _pick(rng, ("angle", "pressure_1", "shaft.angle")): _some(
                rng, {"rms": lambda r: f"{number(r):g} {_pick(r, UNITS)}", "filter": _seconds}
            )
        }
    return _tables(top)


def log(rng: Draw) -> bytes:
    """A CSV of signals over time."""
    return _table(
        rng, ("time_s", "p1_set_kpa", "p2_set_kpa", "p1_kpa", "p2_kpa", "angle_deg", "force1_n")
    )


def force_map(rng: Draw) -> bytes:
    """A CSV of forces over pressure and contraction."""
    return _table(rng, ("p_kpa", "contraction", "force_n"))


def _table(rng: Draw, usual: Sequence[str]) -> bytes:
    """A table of most usual columns and some others."""
    mark, comma = _pick(rng, ((",", False), (";", True), ("\t", False), (" ", False), (";", False)))
    others = [_pick(rng, SIGNALS) for _ in range(int(rng.integers(3)))]
    names = [name for name in usual if rng.random() > 0.05] + others
    names = names if rng.random() < 0.1 else list(dict.fromkeys(names))
    rows = int(_pick(rng, (1, 7, 20, 20, 60)))
    columns = []
    for name in names:
        kind = int(rng.integers(6))
        numbers = (
            np.cumsum(np.full(rows, 0.002)) if name.startswith("t") else rng.uniform(0, 400, rows)
        )
        if kind == 0:
            numbers = np.full(rows, float(number(rng)))
        elif kind == 1:
            numbers = np.array([float(number(rng)) for _ in range(rows)])
        elif kind == 2:
            numbers = np.round(numbers)
        digits = int(rng.integers(1 if kind < 3 else 6, 18))
        columns.append([f"{x:.{digits}g}" for x in numbers])
    if rows and rng.random() < 0.2:
        _pick(rng, columns)[int(rng.integers(rows))] = _pick(rng, WORDS)
    text = io.StringIO()
    written = csv.writer(text, delimiter=mark, lineterminator=_pick(rng, ("\n", "\r\n")))
    if rng.random() < 0.1:
        text.write("# from a logger\nserial 17\n")
    if rng.random() < 0.9:
        written.writerow(names)
    if rng.random() < 0.1:
        written.writerow([_pick(rng, UNITS) for _ in names])
    for row in zip(*columns, strict=True):
        written.writerow([c.replace(".", ",") if comma else c for c in row])
    return text.getvalue().encode(
        _pick(rng, ("utf-8", "utf-8", "utf-8-sig", "utf-16", "cp1252")), "replace"
    )


def signals(rng: Draw) -> bytes:
    """A CSV of any input and output over time, in units of any size."""
    rows = int(_pick(rng, (1, 7, 9, 40, 400)))
    held = np.repeat(rng.standard_normal(rows // 20 + 1), 20)[:rows]
    columns = {"t": 0.01 * np.arange(rows), "u": held, "y": np.zeros(rows)}
    for row in range(1, rows):
        columns["y"][row] = 0.9 * columns["y"][row - 1] + 0.1 * held[row - 1]
    columns["y"] += abs(number(rng)) * rng.standard_normal(rows) * (rng.random() < 0.5)
    for name in columns:
        columns[name] = columns[name] * (float(number(rng)) if rng.random() < 0.4 else 1.0)
    grouped = rng.random() < 0.2  # thousands apart
    text = [[f"{x:,.0f}" if grouped else repr(float(x)) for x in of] for of in columns.values()]
    lines = [";".join(columns), *map(";".join, zip(*text, strict=True))]
    return "\n".join(lines).encode()


def _leaves_of(one: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    if isinstance(one, Mapping):
        return [p for k, v in one.items() for p in _leaves_of(v, (*path, k))]
    return [path]


def params(rng: Draw) -> bytes:
    """A ``params.toml`` of the arm with other numbers, units, laws and keys."""
    text = (shipped_rigs() / "mas20_arm" / "params.toml").read_text(encoding="utf-8")
    content = tomllib.loads(text)
    places = _leaves_of(content)
    for _ in range(int(rng.integers(1, 6))):
        *path, last = _pick(rng, places)
        where: Any = content
        for key in path:
            where = where.get(key, {}) if isinstance(where, dict) else {}
        if not isinstance(where, dict):
            continue
        match int(rng.integers(6)):
            case 0:
                where.pop(last, None)
            case 1:
                where[_pick(rng, WORDS) or "k"] = value(rng)
            case 2 if last == "law":
                where[last] = _pick(rng, (*FORCE_LAWS, *OPERATORS, "none"))
            case 3 if last == "unit":
                where[last] = _pick(rng, UNITS)
            case 4:
                where[last] = value(rng)
            case _:
                where[last] = number(rng) if last == "value" else where.get(last, number(rng))
    return _tables(content)


_ELEMENTS = {
    "": (
        ("size", {"memory": "{n}", "nuser_actuator": "{n}"}),
        ("compiler", {"angle": "{w}", "autolimits": "{w}"}),
        ("option", {"timestep": "{n}", "integrator": "{w}", "gravity": "{n} {n} {n}"}),
        ("default", {"class": "{w}"}),
        ("include", {"file": "{w}"}),
    ),
    "option": (("flag", {"actuation": "disable", "gravity": "disable"}),),
    "body": (
        ("body", {"name": "{w}", "pos": "{n} {n} {n}"}),
        ("joint", {"name": "{w}", "type": "{j}", "range": "{n} {n}", "damping": "{n}"}),
        ("geom", {"type": "{g}", "size": "{n} {n} {n}", "mass": "{n}"}),
        ("site", {"name": "{w}", "pos": "{n} {n} {n}"}),
        ("replicate", {"count": "{n}"}),
    ),
    "tendon": (("spatial", {"name": "{w}", "range": "{n} {n}", "width": "{n}"}),),
    "actuator": (
        ("general", {"name": "{w}", "tendon": "{w}", "gainprm": "{n}", "actdim": "{n}"}),
        ("motor", {"name": "{w}", "joint": "{w}", "gear": "{n}"}),
    ),
}
"""Element -> what may be added to it."""


def mjcf(rng: Draw) -> bytes:
    """The arm's MJCF with elements taken out, doubled, moved, added, and other attributes."""
    root = ET.fromstring((shipped_rigs() / "mas20_arm" / "mas20_arm.xml").read_bytes())
    known = [e.get("name") for e in root.iter() if e.get("name")]

    def filled(form: str) -> str:
        parts: dict[str, Callable[[], str]] = {
            "{n}": lambda: f"{number(rng):.17g}",
            "{w}": lambda: str(_pick(rng, (*known, *WORDS[:12]))),
            "{j}": lambda: str(_pick(rng, ("hinge", "slide", "ball", "free"))),
            "{g}": lambda: str(_pick(rng, ("box", "sphere", "plane", "mesh", "capsule"))),
        }
        return " ".join(parts.get(word, lambda w=word: w)() for word in form.split())

    for _ in range(int(rng.integers(1, 5))):
        every = list(root.iter())
        one, parent = _pick(rng, every), _pick(rng, every)
        match int(rng.integers(5)):
            case 0 if len(one):
                one.remove(_pick(rng, list(one)))
            case 1 if len(one):
                one.append(_pick(rng, list(one)))
            case 2:
                at = "" if parent is root else "body" if parent.tag == "worldbody" else parent.tag
                if at not in _ELEMENTS:
                    continue
                name, attributes = _pick(rng, _ELEMENTS[at])
                kept = {k: filled(v) for k, v in attributes.items() if rng.random() < 0.7}
                ET.SubElement(parent, name, kept)
            case 3 if one.attrib:
                form = " ".join("{n}" for _ in range(int(rng.integers(1, 4))))
                one.set(_pick(rng, list(one.attrib)), filled(_pick(rng, ("{w}", "{n}", form))))
            case _ if one.attrib:
                one.attrib.pop(_pick(rng, list(one.attrib)))
    return ET.tostring(root)


def quantity(rng: Draw) -> bytes:
    """A number with a product, quotient or power of units."""
    text = _pick(rng, UNITS)
    for _ in range(int(rng.integers(4))):
        other = _pick(rng, (*UNITS, f"{number(rng):g}"))
        text = _pick(rng, (f"{text}*{other}", f"{text}/{other}", f"({text})", f"{text}^{other}"))
    return f"{_pick(rng, (number(rng), ''))}{_pick(rng, ('', ' '))}{text}".encode()


def _arrays(rng: Draw) -> dict[str, Any]:
    rows = int(_pick(rng, (0, 1, 7, 50)))
    found: dict[str, Any] = {}
    for name in ("t", "p", *(str(_pick(rng, WORDS[2:9])) for _ in range(int(rng.integers(3))))):
        rows = rows if rng.random() < 0.9 else int(rng.integers(60))
        array = np.arange(rows) * 0.01 if name == "t" else rng.uniform(1e5, 2e5, rows)
        kinds = (float, np.float32, int, bool, complex, str, np.int8, np.float16)
        kept = float if rng.random() < 0.7 else _pick(rng, kinds)
        with np.errstate(all="ignore"):
            array = array.astype(kept)
        if rng.random() < 0.1:
            array = array.reshape((-1, 1) if rng.random() < 0.5 else (1, 1, -1))
        if array.size and array.dtype.kind == "f" and rng.random() < 0.1:
            array.flat[0] = _pick(rng, (np.nan, np.inf, 0.0))
        found[name] = array
    return found


def npz(rng: Draw) -> bytes:
    """An ``.npz`` of arrays of any type and shape."""
    content = io.BytesIO()
    np.savez(content, **_arrays(rng))
    return content.getvalue()


def mat(rng: Draw) -> bytes:
    """A ``.mat`` of the same, some of them in cells and structures."""
    content = io.BytesIO()
    arrays = _arrays(rng)
    if rng.random() < 0.3:
        arrays["s"] = {"a": 1.0, "b": np.ones(3)}
    scipy.io.savemat(content, arrays, do_compression=bool(rng.integers(2)))
    return content.getvalue()


def parquet_table(rng: Draw) -> bytes:
    """A ``.parquet`` of columns of any type."""
    content = io.BytesIO()
    arrays = {k: v.ravel() for k, v in _arrays(rng).items() if v.dtype.kind not in "c"}
    rows = min((a.size for a in arrays.values()), default=0)
    parquet.write_table(pyarrow.table({k: a[:rows] for k, a in arrays.items()}), content)
    return content.getvalue()


def checkpoint(rng: Draw) -> bytes:
    """A JSON that may have the keys of a checkpoint."""
    fits = {_pick(rng, WORDS): {"values": value(rng)} for _ in range(int(rng.integers(4)))}
    return json.dumps(
        {"settings": _pick(rng, ("ab", value(rng))), "fits": _pick(rng, (fits, value(rng)))}
    ).encode()


def policy(rng: Draw) -> bytes:
    """An ``.npz`` with the arrays of a policy in other shapes, types and numbers."""
    with np.load(POLICY) as known:
        arrays = {name: known[name] for name in known.files}
    for name in list(arrays):
        if rng.random() < 0.2:
            flat = arrays[name].ravel()
            others = (np.zeros(()), np.array(_pick(rng, WORDS)), np.full(3, float(number(rng))))
            arrays[name] = _pick(rng, (flat, flat[:1], *others))
        if rng.random() < 0.05:
            del arrays[name]
    content = io.BytesIO()
    np.savez(content, **arrays)
    return content.getvalue()
