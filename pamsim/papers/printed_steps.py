"""The printed MAS-20 rows as experiments: what the rig did before each measured end position.

The paper prints the pressures at which the arm came to rest, not those it started from. Its
operating concept (Matiskova 2021, section 3.1) is that both muscles are filled equally, the arm
rests at the reference point E, and then the pressure of one muscle, the active one, is changed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pamsim.core.errors import InputError, nearest
from pamsim.recordings.experiment import Experiment, pressure_step
from pamsim.recordings.printed import PrintedStep, mas20_steps

DURATION = 6.0
"""Length of a simulated response [s]: ten times the paper's slower time constant."""


@dataclass(frozen=True)
class Start:
    """An assumption on where a step started.

    Attributes:
        name: as given on the command line.
        meaning: the assumption as a sentence.
    """

    name: str
    meaning: str


_SENTENCES = (
    Start(
        "vent",
        "the paper's operating concept: both muscles rest at the higher printed pressure"
        " (reference point E), then the active one is vented to the lower",
    ),
    Start(
        "fill",
        "both muscles rest at the lower printed pressure, then the active one is filled to the"
        " higher",
    ),
    Start(
        "maximum",
        "both muscles rest at the largest printed pressure of all rows (stiffest reference point),"
        " then both are brought to the printed pair",
    ),
)

STARTS: Mapping[str, Start] = {start.name: start for start in _SENTENCES}
"""The assumptions offered; ``vent`` is the default."""


def find_start(name: str) -> Start:
    """The start condition of a name.

    Raises:
        InputError: if there is none.
    """
    if name not in STARTS:
        raise InputError(f"no start {name!r}; {nearest(name, STARTS)}")
    return STARTS[name]


def start_pressures(step: PrintedStep, start: Start) -> tuple[float, float]:
    """Gauge pressures before a printed step [Pa], under an assumption."""
    if start.name == "vent":
        rest = max(step.pressure)
    elif start.name == "fill":
        rest = min(step.pressure)
    else:
        rest = max(max(row.pressure) for row in mas20_steps())
    return rest, rest


def printed_experiment(
    step: PrintedStep, start: Start, *, duration: float = DURATION, sample_rate: float = 500.0
) -> Experiment:
    """A printed row as an experiment.

    Args:
        step: the row.
        start: assumption on its start.
        duration: [s].
        sample_rate: [Hz]; the paper's is 500.
    """
    return pressure_step(
        start_pressures(step, start),
        step.pressure,
        duration=duration,
        load=step.load,
        sample_rate=sample_rate,
        name=f"row {step.row}",
    )
