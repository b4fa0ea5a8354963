"""Shared by the tests of commands."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from pamsim.engine.checks import VARIABLE, checks
from tests.typed_command import run as command

OF_THE_ENGINE = frozenset(
    {"test_callback", "test_laws_in_engine", "test_paper_benches", "test_sliding_bench",
     "test_two_joints"}
)  # fmt: skip
"""Files whose runs are checked step by step: those of commands are long, of the same physics."""


@pytest.fixture
def run(monkeypatch, capsys):
    """Runs ``pamsim WORDS``: its exit code, output and errors."""
    return lambda *words: command(monkeypatch, capsys, *words)


@pytest.fixture(autouse=True)
def pictures_in_pixels_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the SVG and PDF beside each picture: tests of the pages read those."""
    monkeypatch.setattr("pamsim.report.page.save_vectors", lambda figure, path: None)


@pytest.fixture(autouse=True, scope="module")
def steps_of_commands_unchecked(request: pytest.FixtureRequest) -> Iterator[None]:
    """Leave out the checks of every step, in processes that tests start too."""
    if Path(request.path).stem in OF_THE_ENGINE:
        yield
        return
    with pytest.MonkeyPatch.context() as monkeypatch, checks(False):
        monkeypatch.setenv(VARIABLE, "0")
        yield
