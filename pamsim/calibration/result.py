"""The result of a calibration: parameters before and after, and how well they fit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pamsim.comparison.compared_signal import Comparison, pooled_rms, shown_unit
from pamsim.comparison.free_parameters import FreedParameter
from pamsim.core.computation import versions
from pamsim.core.encoding import fields_to_dict, to_dict, write_json
from pamsim.core.parameters import Sourced
from pamsim.engine.rig import Rig
from pamsim.inference.estimate import Estimate, Flag
from pamsim.inference.profile_likelihood import Profile
from pamsim.inference.simulator_fit import FitStatus, SimulatorFit
from pamsim.recordings.rig_writer import write_rig

SCHEMA = "pamsim-calibrate/1"
RESULT_FILE = "calibration.json"
RIG_FOLDER = "rig"


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """A calibrated rig.

    Attributes:
        rig: that it started from.
        sources: of the measurements, as given.
        notes: what a reader should know, one sentence each.
        freed: the free parameters.
        fit: their estimates, the noise, and how the search went.
        profiles: of the parameters asked for.
        comparisons: every channel of every trial and table.
        seed: of the starts.
        simulations: run in all.
        seconds: wall time.
        folder: of the calibrated rig, or None if it was not written.
    """

    rig: Rig
    sources: tuple[str, ...]
    notes: tuple[str, ...]
    freed: tuple[FreedParameter, ...]
    fit: SimulatorFit
    profiles: tuple[Profile, ...]
    comparisons: tuple[Comparison, ...]
    seed: int
    simulations: int
    seconds: float
    folder: Path | None

    @property
    def status(self) -> FitStatus:
        """Whether to trust the numbers."""
        return self.fit.status

    @property
    def parameters(self) -> tuple[Estimate, ...]:
        """The estimates, in the order of ``freed`` [SI]."""
        return self.fit.parameters

    def misfit(self) -> list[dict[str, Any]]:
        """RMS per channel over all its samples, fitted and held out, before and after."""
        rows: list[dict[str, Any]] = []
        for channel in dict.fromkeys(c.channel for c in self.comparisons):
            row: dict[str, Any] = {"channel": channel, "unit": shown_unit(channel)[0]}
            for held, prefix in ((False, ""), (True, "held_out_")):
                parts = [c for c in self.comparisons if c.channel == channel and c.held_out == held]
                for state in ("before", "after"):
                    row[f"{prefix}{state}"] = pooled_rms(parts, state)
            rows.append(row)
        return rows

    def to_dict(self) -> dict[str, Any]:
        """JSON-safe form, SI but for what carries its unit."""
        fit = fields_to_dict(self.fit)
        estimates = fit.pop("parameters")
        return to_dict(
            {
                "schema": SCHEMA,
                "rig": self.rig.name,
                "data": self.sources,
                "notes": self.notes,
                "status": fit.pop("status"),
                "sentence": fit.pop("sentence"),
                "parameters": [
                    {**estimate, **_in_the_rigs_file(freed, estimate)}
                    for freed, estimate in zip(self.freed, estimates, strict=True)
                ],
                "misfit": self.misfit(),
                "trials": self.comparisons,
                "profiles": self.profiles,
                "calibrated_rig": self.folder,
                "fit": fit,
                "seed": self.seed,
                "simulations": self.simulations,
                "seconds": self.seconds,
                "versions": versions("scipy"),
            }
        )

    def summary(self) -> str:
        """Parameters with intervals and warnings, misfit before and after, status."""
        return "\n".join(_summary_lines(self.to_dict()))

    def save(self, folder: str | Path) -> list[Path]:
        """Write the calibrated rig into the subfolder ``rig``, and ``calibration.json`` beside it.

        The folder is created if need be; what was written is returned.
        """
        place = Path(folder)
        rig = write_calibrated_rig(self.rig, self.freed, self.fit, self.sources, place)
        write_json(place / RESULT_FILE, {**self.to_dict(), "calibrated_rig": str(rig)})
        return [rig, place / RESULT_FILE]


def write_calibrated_rig(
    rig: Rig,
    freed: Sequence[FreedParameter],
    fit: SimulatorFit,
    sources: Sequence[str],
    folder: Path,
) -> Path:
    """Write the rig with the numbers of the freed parameters' fit, and their sources.

    What the data do not show stays as it was. The rig's folder is ``rig`` in the one given.
    """
    data = ", ".join(Path(source).name or source for source in sources)
    numbers: dict[str, Sourced] = {}
    for freed_parameter, estimate in zip(freed, fit.parameters, strict=True):
        if Flag.DEAD in estimate.flags:
            continue
        for name in freed_parameter.names:
            tied = [other for other in freed_parameter.names if other != name]
            notes = [f"one number with {', '.join(tied)}" if tied else "", estimate.sentence]
            numbers[name] = Sourced(
                value=estimate.value,
                unit=estimate.unit,
                source=f"identified by pamsim calibrate from {data}",
                where=f"calibrated {name}",
                interval95=estimate.interval95,
                note="; ".join(filter(None, notes)),
            )
    heading = (
        f"Written by pamsim calibrate from {data}.\n"
        f"Status: {fit.status}: {fit.sentence}.\n"
        "Other entries are those of the rig that was calibrated."
    )
    return write_rig(rig.file, folder / RIG_FOLDER, numbers, heading=heading).parent


def _in_the_rigs_file(freed: FreedParameter, estimate: dict[str, Any]) -> dict[str, Any]:
    """What the rig adds to an estimate: tied parameters, the value before, the file's unit."""
    interval = estimate["interval95"]
    return {
        "tied": freed.names[1:],
        "before": freed.before.value,
        "scale": freed.free.scale,
        "range_source": freed.range_source,
        "written": {
            "unit": freed.written_unit,
            "value": freed.written(estimate["value"]),
            "before": freed.written(freed.before.value),
            "interval95": interval and [freed.written(end) for end in interval],
            "bounds": [freed.written(end) for end in estimate["bounds"]],
        },
    }


def _summary_lines(result: dict[str, Any]) -> Iterator[str]:
    yield from (f"note: {note}" for note in result["notes"])
    parameters = result["parameters"]
    width = max(len(p["name"]) for p in parameters)
    yield f"{'parameter':{width}s}       before        after  95 % interval"
    for p in parameters:
        written = p["written"]
        between = written["interval95"]
        interval = "none" if between is None else f"[{between[0]:.5g}, {between[1]:.5g}]"
        unit = "" if written["unit"] == "1" else f" {written['unit']}"
        yield (
            f"{p['name']:{width}s} {written['before']:12.6g} {written['value']:12.6g}"
            f"  {interval}{unit}"
        )
    yield from (f"warning: {p['sentence']}" for p in parameters if p["sentence"])
    yield from (f"determined: {text}" for text in result["fit"]["determined"])
    yield from (f"profile of {p['name']}: {p['sentence']}" for p in result["profiles"])
    rows = {f"{row['channel']} [{row['unit']}]": row for row in result["misfit"]}
    width = max(25, *map(len, rows))
    yield (
        f"{'root mean square misfit':{width}s}{'before':>10s}{'after':>10s}"
        f"{'held-out before':>18s}{'after':>10s}"
    )
    for label, row in rows.items():
        numbers = [row[k] for k in ("before", "after", "held_out_before", "held_out_after")]
        cells = ["none" if n is None else f"{n:.4g}" for n in numbers]
        yield (f"{label:{width}s}{cells[0]:>10s}{cells[1]:>10s}{cells[2]:>18s}{cells[3]:>10s}")
    yield (
        f"{result['status'].replace('_', ' ')}: {result['sentence']}; {result['simulations']}"
        f" simulations in {result['seconds']:.1f} s"
    )
