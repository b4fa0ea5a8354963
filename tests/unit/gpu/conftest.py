"""What the tests of this room need: the extra, and an engine as new as it."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.metadata import version

import pytest

OLD = int(version("mujoco").partition(".")[0]) < 4


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave these tests out with an engine that `mujoco_warp` does not know."""
    for item in items:
        if OLD and "unit/gpu" in item.path.as_posix():
            item.add_marker(pytest.mark.skip(reason="mujoco_warp needs MuJoCo 4"))


@pytest.fixture(scope="session", autouse=True)
def compiled_quickly() -> Iterator[None]:
    """Without optimisation: here compiling takes longer than what is compiled."""
    from pamsim.gpu.port import warp

    config = warp().config
    before, config.optimization_level = config.optimization_level, 0
    yield
    config.optimization_level = before
