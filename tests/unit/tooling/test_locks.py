"""The lock files are complete, checked by hash, and do not depend on where they were made."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[3]
RUN, DEV, LOWEST = "requirements.lock", "requirements-dev.lock", "requirements-lowest.lock"


def entries(name: str) -> dict[str, tuple[str, int]]:
    """Package -> (version, number of hashes)."""
    text = (ROOT / name).read_text().replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line and not line.lstrip().startswith("#")]
    found = {}
    for line in lines:
        match = re.match(r"([a-z0-9-]+)==(\S+)", line)
        assert match, f"{name}: not a pinned package: {line[:80]!r}"
        found[match[1]] = (match[2], len(re.findall(r"--hash=sha256:[0-9a-f]{64}\b", line)))
    return found


def declared(*groups: str) -> list[Requirement]:
    """What pyproject.toml asks for: the run-time packages and those of the groups."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    wanted = list(project["project"]["dependencies"])
    for group in groups:
        wanted += [item for item in project["dependency-groups"][group] if isinstance(item, str)]
    return [Requirement(item) for item in wanted]


@pytest.mark.parametrize("name", [RUN, DEV, LOWEST])
def test_every_package_has_hashes(name: str) -> None:
    packages = entries(name)
    assert len(packages) > 10
    assert [package for package, (_, hashes) in packages.items() if hashes == 0] == []


@pytest.mark.parametrize("name", [RUN, DEV, LOWEST])
def test_no_host_and_no_path(name: str) -> None:
    for line in (ROOT / name).read_text().splitlines():
        assert not re.search(r"://|\.(org|com|io|net)\b|(^|[\s'\"=])/|--find-links|index-url", line)


@pytest.mark.parametrize(
    ("name", "groups"),
    [(RUN, ["build"]), (DEV, ["build", "dev"]), (LOWEST, ["build", "dev"])],
)
def test_lock_answers_pyproject(name: str, groups: list[str]) -> None:
    packages = entries(name)
    for wanted in declared(*groups):
        package = canonicalize_name(wanted.name)
        assert package in packages, f"{name} has no {package}: run `make lock`"
        assert wanted.specifier.contains(packages[package][0]), f"{name}: {wanted}: run `make lock`"


def test_both_locks_agree() -> None:
    run, dev = entries(RUN), entries(DEV)
    assert {package: dev.get(package) for package in run} == run


def test_the_lowest_lock_has_every_lower_bound() -> None:
    packages = entries(LOWEST)
    for wanted in declared("build", "dev"):
        (bound,) = [spec.version for spec in wanted.specifier if spec.operator == ">="]
        found = packages[canonicalize_name(wanted.name)][0]
        # A bound of two numbers stands for the first version that begins with them.
        assert found == bound or found.startswith(f"{bound}."), f"{wanted}: run `make lock`"
