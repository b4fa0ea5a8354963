"""What a rig needs of its MJCF: bounded size, recorded joints, contacts, no visual-only geoms."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pamsim.core.errors import InputError
from pamsim.core.files import read_bounded
from pamsim.core.limits import MJCF_BYTES, MJCF_NUMBERS, MJCF_PARTS, MJCF_PIXELS
from pamsim.core.units import FloatArray

_GENERATING = ("composite", "flexcomp")
_WORDS = ("name", "class", "childclass", "file")  # attributes that are no numbers
_COUNTED = ("njmax", "nconmax", "nuserdata", "nkey", "dim", "actdim", "nsample")
_PLANES = (("width", "height"), ("nrow", "ncol"))

_KINDS = {int(mujoco.mjtJoint.mjJNT_HINGE): "angle", int(mujoco.mjtJoint.mjJNT_SLIDE): "position"}
_UNLIMITED = {"angle": 0.5, "position": 0.05}  # half the range of a joint without limits [rad, m]
# Shares of the joints' ranges at which tendons are measured: one place alone may be a dead centre
# of a spatial tendon.
_PLACES = (0.5, 0.31, 0.73)
_LEAST_ARM = 1e-6  # change of a tendon's length per change of the joint [m/rad or 1]
_JOINT_LIKE = [getattr(mujoco.mjtObj, f"mjOBJ_{kind}") for kind in ("JOINT", "TENDON", "ACTUATOR")]


def read_spec(mjcf: Path) -> mujoco.MjSpec:
    """Read an MJCF.

    Raises:
        OSError: if there is none.
        InputError: if it is too large, not in UTF-8 or not an MJCF.
    """
    read_text(mjcf)
    try:
        return mujoco.MjSpec.from_file(str(mjcf))
    except ValueError as error:
        raise InputError(f"{mjcf}: {' '.join(str(error).split())}") from error


def read_text(mjcf: Path) -> str:
    """Text of an MJCF.

    MuJoCo reads other encodings than UTF-8, but names in them cannot be read back.

    Raises:
        OSError: if there is none.
        InputError: if it is too large, or a line is not UTF-8.
    """
    require_size(mjcf)
    content = mjcf.read_bytes()
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        number = len(content[: error.start + 1].splitlines())
        raise InputError(f"{mjcf}: line {number} is not UTF-8; save the file in UTF-8") from None


def require_size(mjcf: Path) -> None:
    """Refuse an MJCF that asks, with the files that it includes, for more than the limits allow.

    A recording may bring a rig from anywhere, and a short MJCF can ask for millions of bodies, with
    which MuJoCo is busy for hours. What is not XML, or no number, is left to MuJoCo, but for nan,
    which it reads with a warning.

    Raises:
        OSError: if it cannot be read.
        InputError: if it asks for more, or has a number that is nan.
    """
    parts, waiting = 0.0, [(element, 1.0, (mjcf,)) for element in _root(mjcf)]
    while waiting:
        element, times, files = waiting.pop()
        for key, value in element.items():
            if key not in _WORDS and "nan" in value.lower().replace("-", "").split():
                raise InputError(f"{files[-1]}: <{element.tag}> {key}={value!r} is no number")
        asked = [
            (f"{key}={value!r}", value, MJCF_NUMBERS)
            for key, value in element.items()
            if key in _COUNTED or key.startswith("nuser_")
        ]
        asked += [
            (" times ".join(sides), " ".join(element.get(side, "") for side in sides), MJCF_PIXELS)
            for sides in _PLANES
        ]
        for what, text, most in asked:
            if (size := _product(text)) > most:
                raise InputError(
                    f"{files[-1]}: <{element.tag}> {what} is {size:,.0f}; {most:,} is the most"
                )
        inside = times
        if element.tag in ("replicate", *_GENERATING):
            inside *= max(1.0, _product(element.get("count", "")))
        parts += inside if element.tag in _GENERATING else times
        waiting += [(child, inside, files) for child in element]
        file = files[-1].parent / element.get("file", "")
        including = element.tag in ("include", "model") and file.is_file()
        # An endless chain is left to MuJoCo, which refuses it.
        if including and file.resolve() not in [path.resolve() for path in files]:
            waiting += [(root, times, (*files, file)) for root in _root(file)]
    if parts > MJCF_PARTS:
        raise InputError(
            f"{mjcf} asks for {parts:,.0f} elements, those in replicate, composite and flexcomp"
            f" repeated; a rig has {MJCF_PARTS:,} at most"
        )


def _root(mjcf: Path) -> list[ElementTree.Element]:
    try:
        return [ElementTree.fromstring(read_bounded(mjcf, MJCF_BYTES))]
    except ElementTree.ParseError:
        return []


def _product(text: str) -> float:
    """Product of the numbers in a text; 1 where there are none."""
    try:
        return math.prod(float(word) for word in text.split())
    except ValueError:
        return 1.0


def leave_out_visual_geoms(spec: mujoco.MjSpec) -> None:
    """Let a specification compile without the geoms that are only seen.

    They cost a third of every step: MuJoCo places each geom, whether it collides, has mass, or is a
    screw on the housing. Bodies keep the inertia that follows from them, and the dynamics stay
    bit-identical. Where a fluid or sensors of bodies or sites may depend on geoms all are kept.
    """
    sensing = any(sensor.objtype not in _JOINT_LIKE for sensor in spec.sensors)
    if not (spec.option.density or spec.option.viscosity or sensing):
        spec.compiler.discardvisual = True


def recorded_joints(
    model: mujoco.MjModel, named: Iterable[str], tendons: Iterable[str], where: Path
) -> dict[str, str]:
    """The joints that a rig records -> ``angle`` or ``position``.

    Those that its file names, or if there are none all that change the length of its tendons.
    ``where`` is the file, for errors.

    Raises:
        InputError: if a joint is free or a ball, has no name, or there is none.
    """
    found: dict[str, str] = {}
    for index in [model.joint(name).id for name in named] or _moved(model, tendons):
        name, kind = model.joint(index).name, _KINDS.get(int(model.jnt_type[index]))
        if not name:
            raise InputError(
                f"{where}: the muscles move a joint without a name; name it in the MJCF"
            )
        if kind is None:
            raise InputError(
                f"{where}: joint {name!r} neither turns about one axis nor slides along one; name"
                " the joints to record as [rig] joints"
            )
        found[name] = kind
    if not found:
        raise InputError(f"{where}: no joint is moved by the muscles; check their tendons")
    return found


def _moved(model: mujoco.MjModel, tendons: Iterable[str]) -> list[int]:
    """Numbers of the joints that change the length of a muscle's tendon."""
    wanted = [model.tendon(name).id for name in tendons]
    arms, moments = np.zeros(model.nv), np.zeros((model.ntendon, model.nv))
    for data in posed(model, [[place] for place in _PLACES]):
        mujoco.mju_sparse2dense(moments, *sparse_moments(model, data))
        arms = np.maximum(arms, np.abs(moments[wanted]).max(axis=0, initial=0.0))
    return [joint for joint in scalar_joints(model) if arms[model.jnt_dofadr[joint]] > _LEAST_ARM]


def sparse_moments(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[NDArray[Any], ...]:
    """Views of the moment arms of all tendons [m/rad or 1], as ``mju_sparse2dense`` takes them."""
    return data.ten_J, model.ten_J_rownnz, model.ten_J_rowadr, model.ten_J_colind


def scalar_joints(model: mujoco.MjModel) -> list[int]:
    """Numbers of the joints that turn about one axis or slide along one."""
    return np.flatnonzero(np.isin(model.jnt_type, list(_KINDS))).tolist()


def posed(model: mujoco.MjModel, shares: ArrayLike) -> Iterator[mujoco.MjData]:
    """Yield a model's data, its tendons measured, at places within the ranges of its joints.

    ``shares`` is (n, j), of the ranges of `scalar_joints`, 0 to 1; or (n, 1), of all.
    """
    data = mujoco.MjData(model)
    joints = scalar_joints(model)
    places = model.jnt_qposadr[joints]
    half = np.array([_UNLIMITED[_KINDS[int(kind)]] for kind in model.jnt_type[joints]])
    unlimited = model.qpos0[places] + np.array([-half, half])
    low, high = np.where(model.jnt_limited[joints], model.jnt_range[joints].T, unlimited)
    for share in np.asarray(shares):
        data.qpos[places] = low + share * (high - low)
        measure_tendons(model, data)
        yield data


def measure_tendons(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Compute positions and lengths: this part of the engine evaluates no muscle."""
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_tendon(model, data)
    mujoco.mj_transmission(model, data)


def may_collide(model: mujoco.MjModel) -> bool:
    """Whether any geom or flex of a model may touch another."""
    return bool(
        model.npair or model.nflex or model.geom_contype.any() or model.geom_conaffinity.any()
    )


def contacts(
    model: mujoco.MjModel, addresses: Sequence[int], positions: FloatArray
) -> dict[tuple[str, str], int]:
    """Pairs of geoms or flexes that touch, and in how many positions.

    Args:
        model: whose geoms.
        addresses: of joints in ``qpos``; the others are where the model begins.
        positions: (n, j) of these joints [rad or m].
    """

    def name(contact: mujoco.MjContact, side: int) -> str:
        geom, flex = int(contact.geom[side]), int(contact.flex[side])
        if geom < 0:
            return mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_FLEX, flex) or f"flex {flex}"
        body = model.body(model.geom_bodyid[geom]).name
        return model.geom(geom).name or f"geom {geom} of {body}"

    data = mujoco.MjData(model)
    found: Counter[tuple[str, str]] = Counter()
    for row in positions:
        data.qpos[list(addresses)] = row
        mujoco.mj_fwdPosition(model, data)
        touching = [contact for contact in data.contact if contact.exclude == 0]
        found.update({(name(one, 0), name(one, 1)) for one in touching})
    return dict(found)
