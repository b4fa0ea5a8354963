"""Byte offsets of the engine's structs, for the muscles' plugin.

A plugin is handed raw pointers to mjModel and mjData. Their layout differs between MuJoCo
versions, so it is computed from the declarations that the installed MuJoCo ships
(`mujoco.introspect`) by the C layout rules of this platform (`ctypes`), and then checked field by
field against the addresses and values that the Python bindings report.
"""

from __future__ import annotations

import ctypes
import functools
import math
from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
from mujoco.introspect import structs as declarations

from pamsim.core.errors import EngineError

_SCALARS = {
    name: kind
    for kind, names in (
        (ctypes.c_int64, "mjtNum,double,mjtSize,int64_t,uint64_t,size_t,uintptr_t"),
        (ctypes.c_int32, "float,int,unsigned int"),
        (ctypes.c_int8, "char,unsigned char,mjtByte,mjtBool"),
    )
    for name in names.split(",")
}
"""C type -> a type of its size: offsets need no more."""


def _ctype(node: Any) -> Any:
    kind = type(node).__name__
    if kind == "PointerType":
        return ctypes.c_void_p
    if kind == "ArrayType":
        return math.prod(node.extents) * _ctype(node.inner_type)
    if kind in ("AnonymousStructDecl", "AnonymousUnionDecl", "StructDecl"):
        return _laid_out(node.fields, ctypes.Union if "Union" in kind else ctypes.Structure)
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


def _laid_out(fields: Any, base: Any = ctypes.Structure) -> Any:
    own = [
        (getattr(field, "name", f"anonymous{i}"), _ctype(getattr(field, "type", field)))
        for i, field in enumerate(fields)
    ]
    return type(base.__name__, (base,), {"_fields_": own})


@functools.cache
def _declared(name: str) -> Any:
    return _laid_out(declarations.STRUCTS[name].fields)


def offset(struct: str, field: str) -> int:
    """Byte offset of a field of ``mjModel``, ``mjData`` or ``mjOption``.

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


_READ = """
nq nv nactuator nout nuser_actuator actuator_user actuator_actadr actuator_actnum actuator_ctrladr
actuator_outadr actuator_plugin actuator_group;
time plugin_data qpos qvel ctrl act act_dot actuator_length actuator_velocity actuator_force;
timestep integrator disableflags disableactuator
"""
MODEL_FIELDS, DATA_FIELDS, OPTION_FIELDS = (fields.split() for fields in _READ.split(";"))
"""What the plugin reads of ``mjModel``, ``mjData`` and the ``mjOption`` in the model."""


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
    return _record(MODEL_FIELDS + OPTION_FIELDS)


def data_dtype() -> np.dtype[Any]:
    """Record of the fields of mjData that the plugin reads; arrays are addresses."""
    return _record(DATA_FIELDS)


def _record(names: Sequence[str]) -> np.dtype[Any]:
    kinds = {"time": "<f8", "timestep": "<f8"} | dict.fromkeys(OPTION_FIELDS[1:], "<i4")
    offsets = [callback_offsets()[name] for name in names]
    formats = [kinds.get(name, "<i8") for name in names]
    return np.dtype(
        {"names": names, "formats": formats, "offsets": offsets, "itemsize": max(offsets) + 8}
    )


def struct_at(record: np.dtype[Any], address: int) -> Any:
    """The fields of the struct at an address as they are now, and the address, as attributes."""
    memory = ctypes.string_at(address, record.itemsize)
    fields = np.frombuffer(memory, dtype=record)[0].tolist()
    return SimpleNamespace(address=address, **dict(zip(record.names or (), fields, strict=True)))


def verify_offsets(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Check the computed offsets against the addresses that the bindings give.

    Raises:
        EngineError: naming the first field that lies elsewhere.
    """
    for owner, record in ((model, model_dtype()), (data, data_dtype())):
        found = struct_at(record, int(owner._address))
        for name in record.names or ():
            seen = getattr(model.opt if name in OPTION_FIELDS else owner, name)
            if getattr(found, name) != (
                seen if isinstance(seen, int | float) else seen.ctypes.data
            ):
                raise EngineError(
                    f"MuJoCo {mujoco.__version__}: {type(owner).__name__}.{name} is not where its"
                    " declaration puts it; report it"
                )
