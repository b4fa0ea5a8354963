"""What recordings cannot show because of what drives them."""

from __future__ import annotations

from pamsim.comparison.measurements import CalibrationData


def about_the_drive(data: CalibrationData) -> tuple[str, ...]:
    """What trials that are driven by measured pressures cannot show."""
    driven = [trial for trial in data.trials if "measured" in trial.drives.muscles]
    if not driven:
        return ()
    every = all(trial.drives.all_measured for trial in driven)
    which = "all trials are" if len(driven) == len(data.trials) else f"{len(driven)} trials are"
    whose = "the measured pressures" if every else "the measured pressures of some muscles"
    return (
        f"{which} driven by {whose}: they do not show what valves, air and supply do differently"
        f"{'' if every else ' there'}",
    )
