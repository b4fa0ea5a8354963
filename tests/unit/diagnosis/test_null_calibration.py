"""Where there is nothing to find, small p-values are no more frequent than their values."""

import numpy as np
import pytest
from scipy.stats import binom

from tests.records import page, recorded, script

STUDY, RECORD = script("null_calibration"), recorded("results/null_calibration")
DRAWS = 60
MOST = int(binom.ppf(0.9999, DRAWS, 0.05))  # p-values below 0.05, of so many draws


def test_the_tables_of_the_document_are_those_of_the_record():
    assert "\n".join(STUDY.rendered(RECORD)) in page("validation")


def test_the_record_is_judged_as_it_says():
    rows = RECORD["tests"]
    assert all(row["verdict"] == STUDY.judged(row, len(rows)) for row in rows)
    assert {row["runs"] for row in rows} == {500}
    assert len({(row["test"], row["data"]) for row in rows}) == len(rows)
    assert set(dict(STUDY.cases())) == {row["data"] for row in rows}
    # Readings of a single loop that drift do depend on the direction.
    eager = {row["data"] for row in rows if row["verdict"] == "too eager"}
    assert eager == {"10 levels, drifting"}


@pytest.mark.parametrize(
    "kind", ["4 inputs of 3 repeats, drifting", "10 rows, white", "6 levels, white"]
)
def test_false_alarms_are_no_more_than_promised(kind):
    p_values, _ = STUDY.drawn(kind, dict(STUDY.cases())[kind], DRAWS)
    for test, values in p_values.items():
        assert np.sum(values <= 0.05) <= MOST, test
