r"""identify's default choice on public data sets, beside N4SID and output error with hindsight.

    python scripts/identify_literature.py FOLDER [--sets a,b] [--json FILE] [--peers FILE]

FOLDER has one CSV per set: time_s, inputs, outputs (see SETS). The sets are not part of pamsim:
DaISy (De Moor, KU Leuven) has the heating system, heat exchanger, robot arm, ball and beam, CD
player and stirred tank, nonlinearbenchmark.org the cascaded tanks and the Silverbox. Of the
cascaded tanks the estimation record stands before the validation record; of the Silverbox rows
40650 to 57033 of SNLS80mV are taken, which are multisines.

The first half of the samples is identified with pamsim's defaults, only input and output named.
The second half is scored in free run: 100 (1 - |y - yhat| / |y - mean y|). One rule holds for
every method: each sees the input of the second half only, and the initial state of the model and
a constant are fitted to the whole second half by least squares, nothing else. A model that grows
tenfold or more within the half by a pole outside the unit circle has no free run: its
initial state would have to be known to many digits, and fitting it would use the later output.
Such models are left out; what they would score is noted where it would be the best.

Peers are N4SID of orders 1 to 8 with horizons of 20 and 40 samples, and output error of orders 1
to 6, both without and with a direct term D. The one that scores best on the second half is shown,
a choice that no user can make. "pamsim hindsight" is the best of pamsim's own candidates, chosen
in the same way: up to there the choice is to blame, from there on the structures on offer.

The peers need an environment of their own and are fitted once:

    python scripts/identify_literature.py FOLDER --write-records out/identify_literature.npz
    OMP_NUM_THREADS=1 PYTHONPATH=. <venv with sippy-unipi>/bin/python \
        scripts/identify_literature_peers.py out/identify_literature.npz
"""

from __future__ import annotations

import hashlib
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from free_runs import grows, started_freely
from records import RESULTS, parser, print_and_write, read, write_arrays

import pamsim
from pamsim.core.computation import versions
from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.identification.model import IdentifiedModel
from pamsim.identification.records import SignalRecord, fit_percent

RULE = "initial state and a constant, by least squares over the whole second half"

# Name -> file, input and output column.
SETS = {
    "heating system": ("heating_system", "voltage_v", "temp_c"),
    "heat exchanger": ("heat_exchanger", "flow", "temp_c"),
    "robot arm": ("robot_arm", "torque", "acceleration"),
    "ball and beam": ("ball_beam", "beam_angle", "position"),
    "CD player": ("cd_player", "drive1", "track1"),
    "cascaded tanks": ("cascaded_tanks", "pump_v", "level_v"),
    "Silverbox": ("silverbox", "v1", "v2"),
    "CSTR concentration": ("cstr", "coolant", "concentration"),
    "CSTR temperature": ("cstr", "coolant", "temp_k"),
}


@dataclass(frozen=True)
class Halves:
    """One set: its columns and where its second half begins."""

    given: str
    output: str
    table: Any

    @property
    def interval(self) -> float:
        """Sampling time [s]."""
        time_s = self.table["time_s"]
        return float(time_s[-1] - time_s[0]) / (time_s.size - 1)

    def half(self, which: int) -> tuple[FloatArray, FloatArray]:
        """Input and output of the first (0) or second (1) half."""
        middle = self.table.size // 2
        rows = self.table[:middle] if which == 0 else self.table[middle:]
        return rows[self.given], rows[self.output]

    def write_first(self, path: Path) -> None:
        """Write the first half as a user has it: time, one input, one output."""
        given, output = self.half(0)
        table = np.column_stack([self.interval * np.arange(given.size), given, output])
        head = f"time_s,{self.given},{self.output}"
        np.savetxt(path, table, delimiter=",", header=head, comments="", fmt="%.12g")


def halves_of(folder: Path, name: str) -> Halves:
    """One set from its CSV."""
    file, given, output = SETS[name]
    return Halves(given, output, np.genfromtxt(folder / f"{file}.csv", delimiter=",", names=True))


def second_half_fit(model: IdentifiedModel, halves: Halves, hold: str) -> float | None:
    """Score pamsim's model on the second half [%]; None if it has no free run."""
    given, output = halves.half(1)
    step = halves.interval
    record = SignalRecord("second", step * np.arange(given.size), given, output, holds=(hold,))
    poles = np.array(model.poles)
    sampled = np.exp(poles * step) if model.structure.kind == "continuous" else poles
    if grows(sampled, output.size):
        return None
    return fit_percent(output, started_freely(model.simulate(record), sampled, output))


def own(halves: Halves) -> dict[str, Any]:
    """The default choice on the first half, scored on the second, and its best candidate there."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "first_half.csv"
        halves.write_first(path)
        began = time.perf_counter()
        try:
            result = pamsim.identify(path, input=halves.given, output=halves.output)
        except InputError as error:
            return {"error": str(error), "seconds": time.perf_counter() - began}
        seconds = time.perf_counter() - began
    hold = result.used[0].record.holds[0]
    every = {c.name: second_half_fit(c.fit, halves, hold) for c in result.candidates}
    return {
        "recommended": result.recommendation.name or None,
        "shown": result.shown.name,
        "reason": result.recommendation.reason,
        "fit_percent": second_half_fit(result.shown.fit, halves, hold),
        "fit_percent_first_half": result.shown.fit.fit_percent,
        "hindsight": best_of(every),
        "candidates_fit_percent": every,
        "seconds": seconds,
    }


def best_of(fits: dict[str, float | None]) -> dict[str, Any] | None:
    """The best of several models, if any has a score."""
    known = {label: fit for label, fit in fits.items() if fit is not None}
    label = max(known, key=lambda name: known[name], default=None)
    return None if label is None else {"label": label, "fit_percent": known[label]}


def records(folder: Path) -> dict[str, Any]:
    """Both halves of every set as arrays for the peers, input and output each."""
    arrays: dict[str, Any] = {}
    for name in SETS:
        halves = halves_of(folder, name)
        arrays[f"{name}|first"] = np.stack(halves.half(0))
        arrays[f"{name}|second"] = np.stack(halves.half(1))
        arrays[f"{name}|interval"] = np.array(halves.interval)
    return arrays


def digest(arrays: dict[str, Any]) -> str:
    """Fingerprint of the records."""
    parts = b"".join(k.encode() + np.round(v, 12).tobytes() for k, v in sorted(arrays.items()))
    return hashlib.sha256(parts).hexdigest()


def study(folder: Path, names: list[str], peers: dict[str, Any]) -> dict[str, Any]:
    """Every set with pamsim's choice and the peers' best."""
    sets: dict[str, Any] = {}
    for name in names:
        halves = halves_of(folder, name)
        sets[name] = {
            "samples": int(halves.table.size),
            "sample_time_s": halves.interval,
            "pamsim": own(halves),
            "peers": {
                method: {
                    "best": best_of(row["stable"]),
                    "best_unstable": best_of(row["unstable"]),
                    "seconds": row["seconds"],
                }
                for method, row in peers["sets"][name].items()
            },
        }
        print(f"{name}: {sets[name]['pamsim']['seconds']:.1f} s", flush=True)
    return {
        "command": "python scripts/identify_literature.py FOLDER",
        "versions": {**versions("scipy"), "peers": peers["versions"]},
        "fitted_on_the_second_half": RULE,
        "sets": sets,
    }


def main() -> None:
    """Run the study, or write the records that peers are given."""
    asked = parser(__doc__)
    asked.add_argument("folder", type=Path)
    asked.add_argument("--sets", default=",".join(SETS), help="names joined by commas")
    asked.add_argument("--peers", type=Path, default=RESULTS / "identify_literature_peers.json")
    asked.add_argument("--write-records", type=Path, metavar="FILE")
    options = asked.parse_args()
    arrays = records(options.folder)
    if options.write_records:
        write_arrays(options.write_records, arrays, digest(arrays))
        return
    names = [name.strip() for name in options.sets.split(",")]
    if unknown := [name for name in names if name not in SETS]:
        asked.error(f"no set {unknown[0]!r}; there are {', '.join(SETS)}")
    peers = read(options.peers)
    if peers.get("records_sha256") != digest(arrays):
        asked.error(f"{options.peers} was fitted to other records; fit the peers again")
    print_and_write(study(options.folder, names, peers), options.json)


if __name__ == "__main__":
    main()
