"""The CSV file keeps every digit and names its units; numbers on the page read well."""

from __future__ import annotations

import csv

import pytest

from pamsim.core.errors import InputError
from pamsim.report.numbers import (
    FILTERS,
    fixed,
    interval,
    p_value,
    percent,
    plain,
    quantity,
    sentence,
    significant,
    unit,
    words,
)
from pamsim.report.page import page_template, write_page
from pamsim.report.reproduce_page import source_tag, write_reproduction


def read(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.usefixtures("quick")
def test_csv_columns_carry_units_and_values_keep_all_digits(result, tmp_path):
    write_reproduction(result, {}, tmp_path)
    lines = read(tmp_path / "rows.csv")
    assert len(lines) == 24
    assert list(lines[0])[:9] == [
        "row",
        "table",
        "size",
        "p1_kpa",
        "p2_kpa",
        "load_kg",
        "measured_deg",
        "simulated_deg",
        "error_deg",
    ]
    for line, row in zip(lines, result["rows"], strict=True):
        for key in ("p1_kpa", "load_kg", "measured_deg", "simulated_deg", "error_deg"):
            assert float(line[key]) == row[key]
        assert line["monotonic"] == str(row["monotonic"]).lower()
        assert line["repeats"] == ("" if row["repeats"] is None else str(row["repeats"]))


@pytest.mark.usefixtures("quick")
def test_csv_survives_awkward_text_and_missing_values(result, tmp_path):
    text = 'stopped, "badly"\nat 0.2 s; β'
    result["rows"][0].update(simulated_deg=None, error_deg=None, message=text)
    write_reproduction(result, {}, tmp_path)
    line = read(tmp_path / "rows.csv")[0]
    assert line["message"] == text
    assert line["simulated_deg"] == line["error_deg"] == ""


@pytest.mark.parametrize(
    ("written", "wanted"),
    [
        (fixed(-1.504, 2), "−1.50"),
        (fixed(-0.001, 2), "0.00"),
        (fixed(None, 2), "–"),
        (fixed(True, 2), "–"),
        (significant(0.09, 3), "0.0900"),
        (significant(123.4, 3), "123"),
        (significant(-1.2e-8, 3), "−1.20×10⁻⁸"),
        (plain(24000), "24000"),
        (plain(0.64595), "0.64595"),
        (plain(True), "yes"),
        (plain(None), "–"),
        (interval([0.668, 0.676], 3), "0.668 to 0.676"),
        (interval(None, 3), ""),
        (interval([0.1, None], 3), ""),
        (words("output_error"), "output error"),
        (significant(22150.2, 3), "22150"),
        (words(None), ""),
        (unit("dm^3/(s*bar)"), "dm³/(s·bar)"),
        (unit("s^-1"), "s⁻¹"),
        (unit("percent"), "%"),
        (unit("1"), ""),
        (quantity(487.04, "kPa", 4), "487.0 kPa"),
        (quantity(0.5, "1", 2), "0.50"),
        (quantity(None, "kPa", 4), "–"),
        (percent(0.934), "93 %"),
        (percent(0.0016, 1), "0.2 %"),
        (percent(None), "–"),
        (p_value(0.0132), "0.013"),
        (p_value(0.0), "< 0.0001"),
        (p_value(None), "–"),
        (sentence("no parameter at a limit"), "No parameter at a limit."),
        (sentence("Done."), "Done."),
        (sentence(None), ""),
    ],
)
def test_numbers_read_well(written, wanted):
    assert written == wanted


def test_every_function_is_a_filter_and_its_text_is_escaped():
    environment = page_template("base.html").environment
    assert all(environment.filters[function.__name__] is function for function in FILTERS)
    written = environment.from_string("{{ ends | interval(2) }} {{ p | p_value }} {{ n | words }}")
    assert written.render(ends=[0.5, 1.5], p=1e-9, n="<b>") == "0.50 to 1.5 &lt; 0.0001 &lt;b&gt;"


def test_a_page_is_refused_a_result_of_another_schema_and_a_file_for_a_folder(tmp_path):
    with pytest.raises(InputError, match="schema 'other/1'; this page reads 'mine/1'"):
        write_page(tmp_path, "base.html", {"schema": "other/1"}, dict, schema="mine/1")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file; name a folder"):
        write_page(tmp_path / "file", "base.html", {"schema": "mine/1"}, dict, schema="mine/1")


@pytest.mark.parametrize(
    ("source", "tag"),
    [
        ("Matiskova 2021, Table 1 (MAS-20-250)", "paper"),
        ("published constants for DMSP-20-200", "paper"),
        ("identified", "identified"),
        ("Assumed: never printed", "assumed"),
        ("Festo datasheet", "datasheet"),
        ("", "other"),
    ],
)
def test_source_tags(source, tag):
    assert source_tag(source) == tag
