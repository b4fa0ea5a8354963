"""Links of a rig: the parts of its chain that measured signals separate, each compared alone.

    command -> valves and air -> pressure -> muscle -> force -> joint and transmission -> position

A link whose input and output are both measured is simulated with its measured input imposed, so
that a gap shows where it begins, and not in all that follows:

* valves and air: commands as recorded and the measured motion in, pressures out;
* muscle: measured pressures and motion in, forces out;
* joint and transmission: measured forces in; the joint's position out or, of a joint that a machine
  moves, the torque or force that this takes.

What is not measured does not separate: without load cells muscle and joint are one link, without
pressures valves, air and muscle are. A joint is simulated while the measured motion of the others
is imposed. Joints that the rig does not record move freely.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from pamsim.engine.rig import Rig
from pamsim.recordings.signals import kind_of
from pamsim.recordings.trial import Trial

VALVES, MUSCLE, JOINT = "valves and air", "muscle", "joint and transmission"
PARTS = (VALVES, MUSCLE, JOINT)
"""Parts of the chain, from the command on."""

_ENDS = {
    VALVES: ("command", "pressure"),
    MUSCLE: ("pressure", "force"),
    JOINT: ("force", "position"),
}
"""Part -> the signals before and behind it."""

_NAMES = {
    (VALVES, MUSCLE): "valves, air and muscle",
    (MUSCLE, JOINT): "muscle and joint",
    PARTS: "whole chain",
}


def in_links(names: Iterable[str]) -> str:
    """Such as ``in muscle, and in muscle and joint``: a name of a link may hold an *and* itself."""
    return ", and ".join(f"in {name}" for name in names)


@dataclass(frozen=True)
class Link:
    """Neighbouring parts of the chain between two measured signals."""

    parts: tuple[str, ...]  # of `PARTS`, in their order

    @property
    def name(self) -> str:
        """Such as ``valves and air`` or, where no force is measured, ``muscle and joint``."""
        return _NAMES.get(self.parts, self.parts[0])

    @property
    def ends(self) -> tuple[str, str]:
        """Kinds of signal before and behind it, such as ``("command", "pressure")``."""
        return _ENDS[self.parts[0]][0], _ENDS[self.parts[-1]][1]

    @property
    def order(self) -> tuple[int, int]:
        """Sorts links from the command on: by the last part, then by the first."""
        return PARTS.index(self.parts[-1]), PARTS.index(self.parts[0])


@dataclass(frozen=True, kw_only=True)
class LinkRun:
    """How one link of a rig is simulated beside one trial."""

    link: Link  # which
    outputs: tuple[str, ...]  # channels that are compared
    # Whether muscles have their measured pressures; else they are driven as recorded
    pressures: bool
    moved: tuple[str, ...] = ()  # joints whose measured motion is imposed
    pulled: str = ""  # joint that is given the measured forces; empty where muscles exert their own

    @property
    def gives_forces(self) -> bool:
        """Whether its simulated forces are those along the measured motion."""
        return self.link.parts[-1] == MUSCLE


def link_runs(rig: Rig, trial: Trial) -> tuple[LinkRun, ...]:
    """A run of each link that the measured channels of a trial separate, from the command on.

    The channels are as the rig names them, see `pamsim.recordings.trial.of_rig`.
    """
    return tuple(run for run in _runs(rig, trial) if run.outputs)


def joined_runs(rig: Rig, trial: Trial) -> tuple[LinkRun, ...]:
    """As `link_runs`, with muscles and joint as one beside them where forces separate them.

    Its positions show small effects that the noise of load cells hides from both.
    """
    return tuple(run for run in _runs(rig, trial, joined=True) if run.outputs)


def whole_run(rig: Rig, trial: Trial) -> tuple[LinkRun, ...]:
    """The whole chain as one link: nothing is imposed but what drives the trial."""
    return tuple(run for run in _runs(rig, trial, whole=True) if run.outputs)


Runs = Callable[[Rig, Trial], tuple[LinkRun, ...]]
"""What divides the chain: `link_runs`, `joined_runs` or `whole_run`."""


def _runs(
    rig: Rig, trial: Trial, *, joined: bool = False, whole: bool = False
) -> Iterator[LinkRun]:
    drives, names, known = trial.drives, rig.names, free_channels(rig, trial)
    joints = {j: names.joint_channel(j) for j in rig.joints if j not in drives.imposed}
    efforts = {j: names.effort_channel(j) for j in drives.imposed}
    taken = {*joints.values(), *efforts.values()}
    forces = tuple(c for c in names.of_muscles("force") if c in known and c not in taken)
    # Joints that move freely have positions, those that a machine moves efforts.
    positions, efforts = ({j: c for j, c in own.items() if c in known} for own in (joints, efforts))
    commanded = [kind != "measured" for kind in drives.muscles]
    channels = zip(trial.pressure_channels, commanded, strict=True)
    pressures = all(not free or channel in trial.measured for channel, free in channels)
    pressures = pressures and not (whole and any(commanded))
    imposed = tuple(j for j in rig.joints if j in drives.imposed)
    motion = not whole and len(positions) + len(imposed) == len(rig.joints)
    every = tuple(rig.joints) if motion else imposed
    pulling = (MUSCLE,) if pressures else (VALVES, MUSCLE)
    read = tuple(c for c in known if kind_of(c) == "pressure")
    if any(commanded) and pressures:
        parts = (VALVES,) if motion else PARTS
        yield LinkRun(link=Link(parts), outputs=read, pressures=False, moved=every)
    left = () if pressures else read
    if not motion:
        outputs = (*left, *forces, *positions.values(), *efforts.values())
        link = Link((*pulling, JOINT))
        yield LinkRun(link=link, outputs=outputs, pressures=pressures, moved=imposed)
        return
    yield LinkRun(
        link=Link(pulling if forces else (*pulling, JOINT)),
        outputs=(*left, *forces),
        pressures=pressures,
        moved=every,
    )
    separate = len(forces) == len(rig.muscles)
    for apart in (True, False) if separate and joined else (separate,):
        for joint, channel in (positions | efforts).items():
            yield LinkRun(
                link=Link((JOINT,) if apart else (*pulling, JOINT)),
                outputs=(channel,),
                pressures=pressures,
                moved=tuple(j for j in every if j != joint or j in imposed),
                pulled=joint if apart else "",
            )


def free_channels(rig: Rig, trial: Trial) -> tuple[str, ...]:
    """Channels that a trial measures of a rig, but for those that drive it."""
    drives = trial.drives
    muscles = zip(trial.pressure_channels, drives.muscles, strict=True)
    driving = {channel for channel, kind in muscles if kind == "measured"}
    driving |= {rig.names.joint_channel(joint) for joint in drives.imposed}
    return tuple(channel for channel in trial.measured if channel not in driving)
