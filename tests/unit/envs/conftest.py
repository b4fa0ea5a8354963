"""Environments that are closed after their test."""

import gymnasium
import pytest

from pamsim.envs import ENVIRONMENT


@pytest.fixture
def opened():
    found = []

    def make(name=ENVIRONMENT, **options):
        found.append(gymnasium.make(name, **options))
        return found[-1]

    yield make
    for env in found:
        env.close()
