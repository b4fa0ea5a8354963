"""docs/gpu.md: its snippets run, its numbers are those of the record."""

from __future__ import annotations

import re

import gymnasium
import numpy as np
import pytest

from tests.records import page, recorded

RECORD = recorded("results/worlds")
SNIPPETS = re.findall(r"^```python\n(.*?)^```", page("gpu"), re.MULTILINE | re.DOTALL)
DRIVES = {"set points": "pressure_set", "openings of the valves": "valve"}


@pytest.mark.slow
@pytest.mark.parametrize("text", SNIPPETS)
def test_a_snippet_runs(text, capsys):
    names: dict[str, object] = {"__name__": "__main__"}
    exec(compile(text, "snippet", "exec"), names)
    for made in names.values():
        if isinstance(made, gymnasium.vector.VectorEnv):
            made.close()
    printed = [float(line) for line in capsys.readouterr().out.split()]
    assert np.isfinite(printed).all()


def test_the_table_is_that_of_the_record():
    assert len(SNIPPETS) == 2
    lines = [re.split(r"\s*\|\s*", line.strip("| ")) for line in page("gpu").splitlines()]
    rows = [cells for cells in lines if len(cells) == 5 and cells[0] in DRIVES]
    assert len(rows) == 4
    for drive, precision, *cells in rows:
        found = [
            row
            for row in RECORD["rounding_over_10_s"]
            if (row["drive"], row["precision"]) == (DRIVES[drive], precision.strip("`"))
        ]
        assert len(found) == 8
        for name, cell in zip(("angle_deg", "pressure_pa", "tension_n"), cells, strict=True):
            assert float(cell.split()[0]) == max(row[name] for row in found), (drive, name)


def test_the_speed_is_that_of_the_record():
    """Of the device that the page names."""
    assert not RECORD["gpu"]
    assert "No GPU was at hand" in page("gpu")
    (ratio,) = (
        row["ratio"]
        for row in RECORD["speed"]
        if (row["worlds"], row["precision"]) == (1024, "float64")
    )
    (stated,) = re.findall(r"1,024 arms make ([\d.]+) of\s+the steps per second", page("gpu"))
    assert float(stated) == pytest.approx(ratio, abs=0.005)
