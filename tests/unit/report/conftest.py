"""A reproduction answered in closed form, and what every page is held to."""

from __future__ import annotations

import copy
import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from pamsim.core.units import DEG_PER_RAD
from pamsim.engine.rig import load_rig
from pamsim.identification.step_response import identify_step
from pamsim.papers.calibration_record import calibration_record
from pamsim.papers.printed_steps import STARTS
from pamsim.papers.reproduce import Reproduction
from pamsim.papers.reproduce_checks import checks
from pamsim.recordings.printed import mas20_steps
from pamsim.recordings.recording import Recording
from pamsim.report.page import PageImage
from tests.unit.papers.made_up_rows import course, row
from tests.unit.report.page_laws import check_page


@functools.cache
def reproduction() -> Reproduction:
    """The rows end where the rig's record has them, so that the record belongs to them."""
    rig, steps = load_rig("mas20_arm"), mas20_steps()
    record = calibration_record(rig)
    assert record
    numbers = [step.row for step in steps if step.repeats is None]
    errors = dict(zip(numbers, record.used["residual_deg"], strict=True))
    rows = tuple(
        row(step, course(step, errors[step.repeats or step.row] / DEG_PER_RAD)) for step in steps
    )
    large = rows[0].recording
    identified = identify_step(large.time, large.angle)
    return Reproduction(
        rig=rig, start=STARTS["vent"], rows=rows, identified=identified, record=record,
        checks=checks(rows, identified, record, 1.33), seconds=12.34, sensors=True,
    )  # fmt: skip


@functools.cache
def _written() -> dict[str, Any]:
    return reproduction().to_dict()


@pytest.fixture
def result() -> dict[str, Any]:
    """A fresh result of schema ``pamsim-reproduce/1``; tests may change it."""
    return copy.deepcopy(_written())


@pytest.fixture
def recordings() -> dict[int, Recording]:
    """One recording per distinct row of ``result``."""
    return dict(reproduction().recordings)


@pytest.fixture(autouse=True)
def every_page_keeps_the_laws(request: pytest.FixtureRequest) -> Iterator[None]:
    """Hold every page that a test writes to `page_laws`."""
    folder = request.getfixturevalue("tmp_path") if "tmp_path" in request.fixturenames else None
    yield
    for page in folder.rglob("index.html") if folder else ():
        check_page(page.read_text(encoding="utf-8"))


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw the figures but leave out turning them into pixels, the slowest part by far."""

    def touch(figure: Figure, path: Path) -> PageImage:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"")
        return PageImage("data:image/png;base64,", 691, 400, [])

    monkeypatch.setattr("pamsim.report.page.page_image", touch)
