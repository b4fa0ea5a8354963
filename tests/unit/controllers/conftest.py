"""The arm that most controllers are for."""

import pytest

import pamsim


@pytest.fixture(scope="session")
def rig():
    return pamsim.load_rig("mas20_arm")
