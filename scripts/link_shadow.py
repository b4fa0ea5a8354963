"""The diagnosis link by link beside that of the whole chain, on cases of the blind study.

    python scripts/link_shadow.py CASE [CASE ...] [--workers 2] [--json FILE]

Every case is recorded as scripts/blind_study.py records it, three repeats of each input, and
diagnosed as `pamsim diagnose --by-link` does. What the whole chain's
diagnosis said of it is read from results/blind_study_plant.json. Rules were made with these cases:
how often the method is right, others have to show.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from blind_study import CASES, cases, recorded, written
from kept_rows import as_text, fingerprint, kept_rows

import pamsim
from pamsim.comparison.effects_on_rig import candidates
from pamsim.comparison.measurements import read_calibration_data
from pamsim.diagnosis.by_link.diagnose_links import LinkDiagnosis, diagnose_links
from pamsim.diagnosis.held_out_split import held_out_split
from pamsim.diagnosis.recordings import NUISANCE
from pamsim.effects.catalog import EFFECTS

BEFORE = Path(__file__).parent / "results/blind_study_plant.json"
KEPT = Path("out/link_shadow")
REPEATS = 3


def run_one(kind: str, name: str, seed: int) -> dict[str, str]:
    """Record a case, diagnose it link by link, and write down what was found."""
    (case,) = [c for c in cases() if c["name"] == name]
    rig = pamsim.load_rig(case["rig"])
    with tempfile.TemporaryDirectory() as folder:
        recorded(rig, case, REPEATS).save(Path(folder) / "data")
        data = read_calibration_data([str(Path(folder) / "data")]).of_rig(rig)
    began = time.perf_counter()
    found = diagnose_links(
        rig,
        data.trials,
        candidates(rig, (), case["removed"])[0],
        held_out=held_out_split(data, ()).trials,
        nuisance=NUISANCE,
        seed=seed,
        threads=1,
    )
    return as_text({**row(found), "seconds": round(time.perf_counter() - began, 1)})


def row(found: LinkDiagnosis) -> dict[str, Any]:
    """What was found, numbers rounded."""
    return {
        "links": {
            link.name: {
                "before": _rounded(found.before[link]),
                "after": _rounded(found.after[link]),
                "left": _rounded(found.remainders[link].excess),
                "left_p_value": _rounded(found.remainders[link].p_value),
            }
            for link in found.links
        },
        "effects": [
            {
                "label": one.effect.label,
                "place": one.effect.effect.link,
                "family": one.effect.family,
                "level": one.level(),
                "exact": one.exact,
                "gain": _rounded(one.gain),
                "share": _rounded(one.share),
                "p_value": _rounded(one.p_value),
                "rivals": [
                    [
                        r.effect.label,
                        r.effect.family,
                        _rounded(r.excess),
                        _rounded(r.p_value),
                        [_rounded(float(one)) for one in r.by_trial],
                    ]
                    for r in one.rivals
                ],
            }
            for one in found.effects
        ],
        "sizes": {
            name: [_rounded(size.value), [_rounded(end) for end in size.interval95]]
            for name, size in found.sizes.items()
        },
    }


def _rounded(value: float) -> float:
    return float(f"{value:.4g}") if np.isfinite(value) else value


def counts(rows: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, int]]:
    """Per tier: causes that are hidden, and families called certain, right and wrong."""
    found: dict[str, dict[str, int]] = {}
    for one in rows:
        hidden = [set(effect["families"]) for effect in one["hidden"]]
        by_link = {e["family"] for e in one["effects"] if e["level"] in ("family", "name", "form")}
        tier = found.setdefault(one["tier"], dict.fromkeys(COUNTS, 0))
        tier["cases"] += 1
        tier["hidden"] += len(hidden)
        for key, certain in (("by_link", by_link), ("whole_chain", set(one["whole_chain"]))):
            tier[f"{key}_right"] += sum(bool(families & certain) for families in hidden)
            tier[f"{key}_wrong"] += sum(not any(c in f for f in hidden) for c in certain)
    return found


COUNTS = (
    "cases", "hidden", "by_link_right", "by_link_wrong", "whole_chain_right", "whole_chain_wrong",
)  # fmt: skip


def before(names: Sequence[str]) -> list[dict[str, Any]]:
    """Cases with what was hidden and the families that the whole chain's diagnosis was sure of."""
    rows = {r["name"]: r for r in json.loads(BEFORE.read_text(encoding="utf-8"))["rows"]}
    found: list[dict[str, Any]] = []
    for name in names:
        row = rows[name]
        sure = {EFFECTS[claim.partition(" at ")[0]].family for claim in row["certain"]}
        kept = {key: row[key] for key in ("name", "tier", "effects", "excess", "noise", "seed")}
        hidden = [{k: one[k] for k in ("name", "families")} for one in row["hidden"]]
        found.append(
            {
                **kept,
                "hidden": hidden,
                "whole_chain_verdict": row["verdict"],
                "whole_chain": sorted({*sure, *row["families"]}),
                "whole_chain_seconds": row["seconds"],
            }
        )
    return found


def main() -> None:
    """Run what is left, count, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="+", metavar="CASE")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    known = before(options.names)
    mark = fingerprint(("pamsim", "tests.plant"), __file__, CASES)
    tasks = [("by link", one["name"], one["seed"]) for one in known]
    rows = kept_rows(run_one, tasks, KEPT, mark, options.workers)
    done = [{**one, **rows["by link", one["name"], one["seed"]]} for one in known]
    result = {
        "schema": "pamsim-link-shadow/1",
        "command": "python scripts/link_shadow.py " + " ".join(options.names),
        "fingerprint": mark,
        "counts": counts(done),
        "rows": done,
    }
    print(json.dumps(result["counts"], indent=1))
    if options.json is not None:
        options.json.write_text(written(result), encoding="utf-8")


if __name__ == "__main__":
    main()
