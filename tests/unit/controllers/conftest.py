"""The arm that most controllers are for."""

from __future__ import annotations

import pytest

import pamsim


@pytest.fixture(scope="session")
def rig():
    return pamsim.load_rig("mas20_arm")
