"""Shared by the tests of commands."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def pictures_in_pixels_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the SVG and PDF beside each picture: tests of the pages read those."""
    monkeypatch.setattr("pamsim.report.page.save_vectors", lambda figure, path: None)
