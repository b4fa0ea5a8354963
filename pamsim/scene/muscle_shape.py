"""The shape of one braided muscle.

It follows the muscle's length as the braid does: fibres of constant length and a constant number of
turns, so a shorter muscle is thicker and its braid opens.
"""

from __future__ import annotations

import math
from itertools import pairwise

import mujoco
import numpy as np

from pamsim.core.errors import InputError
from pamsim.physics.braid import Braid
from pamsim.scene.series_colours import Rgb
from pamsim.scene.solids import BOX, ELLIPSOID, Rgba, Vector, add_rod

DRAWN_FOR = 0.020
"""Inner diameter that the radii below are of, a MAS-20's [m]; others are drawn in proportion."""
WALL = 0.002
"""Wall thickness [m], taken as constant: a change of some 0.3 mm would not be seen."""
MOVING_REACH = 0.050
"""Distance from the end of the active length to the first pin of the chain [m]."""
FULL_PRESSURE = 600e3
"""Gauge pressure at which a muscle has the full colour of its curve [Pa]."""

_VENTED = (0.12, 0.14, 0.18)
_WHITE = (1.0, 1.0, 1.0)
_FIBRE_LIGHT = 0.35  # how much lighter than the tube its fibres are, as a share of the way to white
_UNKNOWN_RUBBER: Rgba = (0.42, 0.42, 0.43, 1.0)
_UNKNOWN_FIBRE: Rgba = (0.66, 0.66, 0.67, 1.0)
_ALUMINIUM: Rgba = (0.74, 0.76, 0.78, 1.0)
_STEEL: Rgba = (0.58, 0.59, 0.60, 1.0)

_NECK = DRAWN_FOR / 2 + WALL - 0.0005
_COUNT, _SEGMENTS, _THREAD = 8, 36, 0.00045
"""Fibres of either sense, straight pieces of each, and half their width [m]."""
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


def outer_radius(length: float, braid: Braid) -> float:
    """Outer radius [m] of the cylindrical part at an active length [m], by constant fibres.

    Raises:
        InputError: no braid of this fibre can have that length.
    """
    straight = braid.nominal_length / math.cos(braid.fibre_angle)
    if not 0.0 < length < straight:
        raise InputError(f"muscle length {length} m cannot be drawn: allowed (0, {straight:.4f}) m")
    sine = math.sqrt(1.0 - (length / straight) ** 2)
    inner = braid.diameter / 2 * sine / math.sin(braid.fibre_angle)
    return inner + braid.diameter / DRAWN_FOR * WALL


def add_muscle(
    scene: mujoco.MjvScene,
    anchor: Vector,
    frame: Vector,
    length: float,
    pressure: float,
    colour: Rgb,
    braid: Braid,
    *,
    fibres: bool = True,
) -> None:
    """Add one muscle with its two end fittings; a chain begins `MOVING_REACH` beyond its end.

    The active length [m] starts at an anchor (3,) [m], along the third axis of a frame (3, 3). The
    tube has the more of its colour the higher the gauge pressure [Pa], and is grey if that is NaN.

    Raises:
        InputError: the length cannot be drawn.
    """
    axis, scale = frame[:, 2], braid.diameter / DRAWN_FOR
    radius = outer_radius(length, braid)
    rubber, fibre = _UNKNOWN_RUBBER, _UNKNOWN_FIBRE
    if not math.isnan(pressure):
        rubber = _mixed(_VENTED, colour, min(max(pressure / FULL_PRESSURE, 0.0), 1.0))
        fibre = _mixed(rubber[:3], _WHITE, _FIBRE_LIGHT)
    shoulder, semi_axis = _shoulder(radius, scale * _NECK)
    tube = shoulder, length - shoulder
    first, last = (anchor + at * axis for at in tube)
    add_rod(scene, first, last, radius, rubber)
    for at in tube if shoulder > 0.0 else ():
        ends = anchor + (at - semi_axis) * axis, anchor + (at + semi_axis) * axis
        add_rod(scene, *ends, radius, rubber, kind=ELLIPSOID)
    if fibres:
        turns = braid.nominal_length * math.tan(braid.fibre_angle) / (math.pi * braid.diameter)
        along = np.linspace(0.0, length, _SEGMENTS + 1)
        inward = np.clip(shoulder - np.minimum(along, length - along), 0.0, None)
        skin = radius * np.sqrt(1.0 - (inward / max(semi_axis, 1e-9)) ** 2)
        for thread in _helices(skin, along, turns) @ frame.T + anchor:
            for start, end in pairwise(thread):
                # Square: nobody sees it, and a box is drawn many times faster than a cylinder. Its
                # shadow would fall on the rubber right below.
                width = scale * _THREAD
                add_rod(scene, start, end, width, fibre, kind=BOX, gloss=0.2, shadow=False)
    for start, end, size, metal in _FITTING:
        for foot, outward in ((anchor, -axis), (anchor + length * axis, axis)):
            ends = foot + start * outward, foot + end * outward
            add_rod(scene, *ends, scale * size, metal or (*colour, 1.0), gloss=0.7)


def _helices(radius: Vector, along: Vector, turns: float) -> Vector:
    """(fibres, n, 3) points of both families of fibres on a skin around the third axis."""
    starts = np.arange(_COUNT) * (2.0 * math.pi / _COUNT)
    twist = 2.0 * math.pi * turns * along / along[-1]
    angle = np.concatenate([starts[:, None] + sense * twist for sense in (1.0, -1.0)])
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle + along], axis=-1)


def _mixed(one: Rgb, other: Rgb, share: float) -> Rgba:
    """A share of the way from one colour to another."""
    red, green, blue = (a + share * (b - a) for a, b in zip(one, other, strict=True))
    return red, green, blue, 1.0


def _shoulder(radius: float, neck: float) -> tuple[float, float]:
    """Length of the shoulder and axial semi-axis of the ellipsoid that rounds it [m].

    The ellipsoid joins the cylinder without a kink and has the neck's radius at the fitting.
    """
    if radius <= neck:
        return 0.0, 0.0
    slope = math.sqrt(1.0 - (neck / radius) ** 2)
    length = 0.010 + 1.4 * (radius - neck)
    # Close to the nominal length the ellipsoid is slender: its tip must end inside the fitting.
    length = min(length, 0.020 * slope / (1.0 - slope))
    return length, length / slope
