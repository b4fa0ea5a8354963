"""The shape of one braided muscle, as a list of simple solids: pure geometry, no engine.

The solids follow the muscle's length as the braid does: fibres of constant length and a constant
number of turns, so a shorter muscle is thicker and its braid opens. Nothing here has mass or force.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pamsim.core.errors import InputError
from pamsim.physics.braid import Braid
from pamsim.scene.series_colours import Rgb

Vector = npt.NDArray[np.float64]
Rgba = tuple[float, float, float, float]

DRAWN_FOR = 0.020
"""Inner diameter that the radii below are of, a MAS-20's [m]; others are drawn in proportion."""
WALL = 0.002
"""Wall thickness [m], taken as constant: a change of some 0.3 mm would not be seen."""
MOVING_REACH = 0.050
"""Distance from the end of the active length to the first pin of the chain [m]."""

FULL_PRESSURE = 600e3
"""Gauge pressure at which a muscle has the full colour of its curve [Pa]."""
_VENTED = (0.12, 0.14, 0.18)
_FIBRE_LIGHT = 0.35
"""How much lighter than the tube its fibres are, as a share of the way to white."""
_UNKNOWN_RUBBER: Rgba = (0.42, 0.42, 0.43, 1.0)
_UNKNOWN_FIBRE: Rgba = (0.66, 0.66, 0.67, 1.0)
_ALUMINIUM: Rgba = (0.74, 0.76, 0.78, 1.0)
_STEEL: Rgba = (0.58, 0.59, 0.60, 1.0)

_NECK = DRAWN_FOR / 2 + WALL - 0.0005
_COUNT = 8
_SEGMENTS = 36
_THREAD = 0.00045
"""Half the width of a fibre [m]."""
# One end fitting outward from the active length: start [m], end [m], radius [m], colour; None: the
# muscle's own.
_FITTING: tuple[tuple[float, float, float, Rgba | None], ...] = (
    (-0.005, 0.014, 0.0155, None),
    (0.014, 0.0155, 0.0140, _STEEL),
    (0.0155, 0.023, 0.0150, None),
    (0.023, 0.031, 0.0100, _ALUMINIUM),
    (0.031, 0.034, 0.0080, _STEEL),
    (0.034, 0.0455, 0.0045, _STEEL),
)


@dataclass(frozen=True, kw_only=True)
class Solid:
    """One simple solid in world coordinates."""

    kind: str
    """``cylinder`` or ``capsule`` (size: radius, half length), ``box``, ``ellipsoid`` (halves)."""
    size: tuple[float, float, float]
    """Sizes [m]; the axis of a cylinder or capsule is the third column of ``rotation``."""
    position: Vector
    """(3,) centre [m]."""
    rotation: Vector
    """(3, 3) columns are the solid's axes [-]."""
    rgba: Rgba
    """Colour and opacity, each 0 to 1."""
    gloss: float = 0.5
    """Specular reflection, 0 to 1."""
    shadow: bool = True
    """Whether it casts one."""


def outer_radius(length: float, braid: Braid) -> float:
    """Return the outer radius of the cylindrical part from a constant fibre length.

    Args:
        length: active length [m], between 0 and the length at which the fibres lie straight.
        braid: size and fibre angle of the muscle.

    Returns:
        Outer radius [m]; 12 mm at the nominal length of a MAS-20.

    Raises:
        InputError: no braid of this fibre can have that length.
    """
    straight = braid.nominal_length / math.cos(braid.fibre_angle)
    if not 0.0 < length < straight:
        raise InputError(f"muscle length {length} m cannot be drawn: allowed (0, {straight:.4f}) m")
    sine = math.sqrt(1.0 - (length / straight) ** 2)
    inner = braid.diameter / 2 * sine / math.sin(braid.fibre_angle)
    return inner + _scale(braid) * WALL


def _scale(braid: Braid) -> float:
    return braid.diameter / DRAWN_FOR


def muscle_solids(
    anchor: Vector,
    axis: Vector,
    length: float,
    pressure: float,
    colour: Rgb,
    braid: Braid,
    *,
    fibres: bool = True,
) -> list[Solid]:
    """Build one muscle with its two end fittings.

    Args:
        anchor: (3,) where the active length starts [m].
        axis: (3,) unit vector from the anchor along the muscle [-].
        length: active length [m].
        pressure: gauge pressure, which sets how much of its colour the tube has [Pa]; grey if NaN,
            not known.
        colour: of the muscle, as of its curves, 0 to 1 each.
        braid: size and fibre angle of the muscle.
        fibres: whether to draw them.

    Returns:
        Solids in world coordinates; the chain begins at anchor + (length + MOVING_REACH) * axis.

    Raises:
        InputError: the length cannot be drawn.
    """
    frame = frame_along(axis)
    radius, scale = outer_radius(length, braid), _scale(braid)
    rubber, fibre = _UNKNOWN_RUBBER, _UNKNOWN_FIBRE
    if not math.isnan(pressure):
        share = float(np.clip(pressure / FULL_PRESSURE, 0.0, 1.0))
        rubber = _mixed(_VENTED, colour, share)
        fibre = _mixed(rubber[:3], (1.0, 1.0, 1.0), _FIBRE_LIGHT)
    shoulder, semi_axis = _shoulder(radius, scale * _NECK)

    solids = [rod(anchor + shoulder * axis, anchor + (length - shoulder) * axis, radius, rubber)]
    if shoulder > 0.0:
        solids += [
            Solid(
                kind="ellipsoid",
                size=(radius, radius, semi_axis),
                position=anchor + at * axis,
                rotation=frame,
                rgba=rubber,
            )
            for at in (shoulder, length - shoulder)
        ]
    if fibres:
        solids += _fibres(anchor, frame, length, braid, fibre)
    tip = anchor + length * axis
    for start, end, size, metal in _FITTING:
        for foot, outward in ((anchor, -axis), (tip, axis)):
            ends = foot + start * outward, foot + end * outward
            solids.append(rod(*ends, scale * size, metal or (*colour, 1.0), gloss=0.7))
    return solids


def rod(
    start: Vector,
    end: Vector,
    radius: float,
    rgba: Rgba,
    *,
    kind: str = "cylinder",
    gloss: float = 0.5,
) -> Solid:
    """Return a cylinder or capsule between two points.

    Args:
        start: (3,) one end of the axis [m].
        end: (3,) the other end [m].
        radius: radius [m].
        rgba: colour and opacity.
        kind: ``"cylinder"`` or ``"capsule"``.
        gloss: specular reflection, 0 to 1.

    Returns:
        The solid; its third axis points from start to end.
    """
    along = end - start
    distance = float(np.linalg.norm(along))
    return Solid(
        kind=kind,
        size=(radius, distance / 2, 0.0),
        position=(start + end) / 2,
        rotation=frame_along(along / distance),
        rgba=rgba,
        gloss=gloss,
    )


def frame_along(axis: Vector) -> Vector:
    """Return a rotation whose third column is the given unit vector.

    Args:
        axis: (3,) unit vector [-].

    Returns:
        (3, 3) right-handed rotation [-].
    """
    # Written out: a picture has hundreds of solids, and numpy's cross product is slow for one.
    x, y, z = axis.tolist()
    a, b, c = (-y, x, 0.0) if abs(z) < 0.9 else (0.0, -z, y)
    size = math.sqrt(a * a + b * b + c * c)
    a, b, c = a / size, b / size, c / size
    return np.array(
        [[a, y * c - z * b, x], [b, z * a - x * c, y], [c, x * b - y * a, z]], dtype=np.float64
    )


def _mixed(one: Rgb, other: Rgb, share: float) -> Rgba:
    """A share of the way from one colour to another."""
    red, green, blue = (a + share * (b - a) for a, b in zip(one, other, strict=True))
    return red, green, blue, 1.0


def _shoulder(radius: float, neck: float) -> tuple[float, float]:
    """Return length of the shoulder and axial semi-axis of the ellipsoid that rounds it [m].

    The ellipsoid joins the cylinder without a kink and has the neck's radius at the fitting.
    """
    if radius <= neck:
        return 0.0, 0.0
    slope = math.sqrt(1.0 - (neck / radius) ** 2)
    length = 0.010 + 1.4 * (radius - neck)
    # Close to the nominal length the ellipsoid is slender: its tip must end inside the fitting.
    length = min(length, 0.020 * slope / (1.0 - slope))
    return length, length / slope


def _fibres(anchor: Vector, frame: Vector, length: float, braid: Braid, rgba: Rgba) -> list[Solid]:
    """Wind two families of fibres with a fixed number of turns over the muscle's skin."""
    turns = braid.nominal_length * math.tan(braid.fibre_angle) / (math.pi * braid.diameter)
    radius, scale = outer_radius(length, braid), _scale(braid)
    shoulder, semi_axis = _shoulder(radius, scale * _NECK)
    along = np.linspace(0.0, length, _SEGMENTS + 1)
    inward = np.clip(shoulder - np.minimum(along, length - along), 0.0, None)
    skin = (
        radius * np.sqrt(1.0 - (inward / semi_axis) ** 2)
        if shoulder
        else np.full_like(along, radius)
    )
    starts = np.arange(_COUNT) * (2.0 * math.pi / _COUNT)
    twist = 2.0 * math.pi * turns * along / length
    angle = np.concatenate([starts[:, None] + sense * twist for sense in (1.0, -1.0)])
    local = np.stack([skin * np.cos(angle), skin * np.sin(angle), 0.0 * angle + along], axis=-1)
    points = anchor + local @ frame.T
    return _threads(
        points[:, :-1].reshape(-1, 3), points[:, 1:].reshape(-1, 3), scale * _THREAD, rgba
    )


def _threads(starts: Vector, ends: Vector, size: float, rgba: Rgba) -> list[Solid]:
    """Join (k, 3) pairs of points by threads.

    They are square: at this thickness nobody sees it, and a box is drawn many times faster than a
    cylinder.
    """
    along = ends - starts
    half = np.linalg.norm(along, axis=1) / 2.0
    axes = along / (2.0 * half[:, None])
    flat = np.abs(axes[:, 2:]) < 0.9
    first = np.cross(np.where(flat, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]), axes)
    first /= np.linalg.norm(first, axis=1)[:, None]
    frames = np.stack([first, np.cross(axes, first), axes], axis=-1)
    return [
        Solid(
            kind="box",
            size=(size, size, reach),
            position=middle,
            rotation=turned,
            rgba=rgba,
            gloss=0.2,
            shadow=False,  # it would fall on the rubber right below
        )
        for middle, turned, reach in zip((starts + ends) / 2.0, frames, half.tolist(), strict=True)
    ]
