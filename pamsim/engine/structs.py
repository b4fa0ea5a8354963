"""Byte offsets of the engine's structs, for the muscles' plugin.

A plugin is handed raw pointers to mjModel and mjData. Their layout differs between MuJoCo
versions, so it is computed from the declarations that the installed MuJoCo ships
(`mujoco.introspect`) by the C layout rules of this platform (`ctypes`), and then checked field by
field against the addresses and values that the Python bindings report.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
from mujoco.introspect import structs as declarations

from pamsim.core.errors import EngineError

_SCALARS: dict[str, Any] = {
    "mjtNum": ctypes.c_double,
    "double": ctypes.c_double,
    "float": ctypes.c_float,
    "int": ctypes.c_int,
    "unsigned int": ctypes.c_uint,
    "char": ctypes.c_char,
    "unsigned char": ctypes.c_ubyte,
    "mjtByte": ctypes.c_ubyte,
    "mjtBool": ctypes.c_bool,
    "mjtSize": ctypes.c_int64,
    "int64_t": ctypes.c_int64,
    "uint64_t": ctypes.c_uint64,
    "size_t": ctypes.c_size_t,
    "uintptr_t": ctypes.c_size_t,
}


def _ctype(node: Any) -> Any:
    kind = type(node).__name__
    if kind == "PointerType":
        return ctypes.c_void_p
    if kind == "ArrayType":
        inner = _ctype(node.inner_type)
        for extent in reversed(node.extents):
            inner = inner * extent
        return inner
    if kind in ("AnonymousStructDecl", "AnonymousUnionDecl", "StructDecl"):
        base = ctypes.Union if kind == "AnonymousUnionDecl" else ctypes.Structure
        return _structure(kind, node.fields, base)
    name = str(node.name)
    if name in _SCALARS:
        return _SCALARS[name]
    if name in declarations.STRUCTS:
        return _declared(name)
    if name.startswith("mjt"):
        return ctypes.c_int  # the remaining mjt types are enums
    raise EngineError(
        f"MuJoCo {mujoco.__version__} declares a field of type {name!r} that pamsim cannot lay out;"
        " report it"
    )


def _structure(name: str, fields: Any, base: Any = ctypes.Structure) -> Any:
    laid_out = [
        (getattr(field, "name", f"anonymous{i}"), _ctype(getattr(field, "type", field)))
        for i, field in enumerate(fields)
    ]
    return type(name, (base,), {"_fields_": laid_out})


@functools.cache
def _declared(name: str) -> Any:
    return _structure(name, declarations.STRUCTS[name].fields)


def offset(struct: str, field: str) -> int:
    """Byte offset of a field.

    Args:
        struct: ``mjModel``, ``mjData`` or ``mjOption``.
        field: name of the field.

    Raises:
        EngineError: if the installed MuJoCo has no such field.
    """
    layout = getattr(_declared(struct), field, None)
    if layout is None:
        raise EngineError(
            f"MuJoCo {mujoco.__version__} has no {struct}.{field}, which pamsim's muscles"
            " read, with backend='python' too; install a version in the range of pyproject.toml"
        )
    return int(layout.offset)


MODEL_FIELDS = (
    "nq",
    "nv",
    "nactuator",
    "nout",
    "nuser_actuator",
    "actuator_user",
    "actuator_actadr",
    "actuator_actnum",
    "actuator_ctrladr",
    "actuator_outadr",
    "actuator_plugin",
    "actuator_group",
)
DATA_FIELDS = (
    "time",
    "plugin_data",
    "qpos",
    "qvel",
    "ctrl",
    "act",
    "act_dot",
    "actuator_length",
    "actuator_velocity",
    "actuator_force",
)
OPTION_FIELDS = ("timestep", "integrator", "disableflags", "disableactuator")


@functools.cache
def callback_offsets() -> Mapping[str, int]:
    """Offsets of every field the plugin touches, as ``{"time": 123, ...}``."""
    offsets = {name: offset("mjModel", name) for name in MODEL_FIELDS}
    offsets |= {name: offset("mjData", name) for name in DATA_FIELDS}
    option = offset("mjModel", "opt")
    offsets |= {name: option + offset("mjOption", name) for name in OPTION_FIELDS}
    return offsets


def model_dtype() -> np.dtype[Any]:
    """Record of the fields of mjModel that the plugin reads; arrays are addresses."""
    return _record((*MODEL_FIELDS, *OPTION_FIELDS))


def data_dtype() -> np.dtype[Any]:
    """Record of the fields of mjData that the plugin reads; arrays are addresses."""
    return _record(DATA_FIELDS)


def _record(names: tuple[str, ...]) -> np.dtype[Any]:
    kinds = {"time": "<f8", "timestep": "<f8"} | dict.fromkeys(OPTION_FIELDS[1:], "<i4")
    offsets = [callback_offsets()[name] for name in names]
    formats = [kinds.get(name, "<i8") for name in names]
    return np.dtype(
        {"names": names, "formats": formats, "offsets": offsets, "itemsize": max(offsets) + 8}
    )


def struct_at(record: np.dtype[Any], address: int) -> Any:
    """The fields of a struct of the engine as they are now, as attributes.

    Args:
        record: `model_dtype` or `data_dtype`.
        address: of the struct.
    """
    memory = ctypes.string_at(address, record.itemsize)
    fields = np.frombuffer(memory, dtype=record)[0].tolist()
    return SimpleNamespace(**dict(zip(record.names or (), fields, strict=True)))


def verify_offsets(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Check the computed offsets against the addresses that the bindings give.

    Raises:
        EngineError: naming the first field that lies elsewhere.
    """
    offsets = callback_offsets()
    seen_fields = [(model, name, getattr(model, name)) for name in MODEL_FIELDS]
    seen_fields += [(data, name, getattr(data, name)) for name in DATA_FIELDS]
    seen_fields += [(model, name, getattr(model.opt, name)) for name in OPTION_FIELDS]
    for owner, name, seen in seen_fields:
        address = int(owner._address) + offsets[name]
        if isinstance(seen, float):
            agrees = ctypes.c_double.from_address(address).value == seen
        elif isinstance(seen, int):
            width = ctypes.c_int if name in OPTION_FIELDS else ctypes.c_int64
            agrees = width.from_address(address).value == seen
        else:
            agrees = ctypes.c_void_p.from_address(address).value == seen.ctypes.data
        if not agrees:
            raise EngineError(
                f"MuJoCo {mujoco.__version__}: {type(owner).__name__}.{name} is not where its"
                " declaration puts it; report it"
            )
