"""Which numbers of the documents a test holds to their source: each is changed, one at a time.

    python scripts/doc_numbers.py [--pages validation real_data] [--json FILE]

The quick tests that read pages run once, to see which page each reads. Then every number in the
prose and the tables of a page is changed in its last digit, in a fork of this process that reads
the changed text, and the tests of that page run until one fails. The record names, for each number,
that test, or the source that ``doc_numbers.toml`` states for its line: a long test, the record of a
study, a constant, a definition. Left out are code blocks, which tests execute, formulas, links,
ordinals, years of citations and numbers that are names, such as Table 2. Exits 1 if a number has no
source.
"""

from __future__ import annotations

import functools
import os
import re
import sys
import time
import tomllib
from pathlib import Path
from typing import Any

import pytest
from records import head, parser, write
from tqdm import tqdm

ROOT = Path(__file__).parents[1]
PAGES = {path.stem: path for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))}
LONGEST = 6.0
"""Of a test that is run again and again [s]."""
TESTS = ("unit", "integration", "physics")
READ = re.compile(r"tests\.records import [^\n]*\b(page|words)\b|page_blocks|\"docs\"")
"""In a file of tests that read pages."""
LONG = "not (snippet or walk or page_runs or random_steps or demo)"
"""Leaves out tests that run what pages show: `LONGEST` would leave them out, minutes later."""
STATED = Path(__file__).with_suffix(".toml")

_NAMES = (
    "tables? figures? sections? rows? cases? codes? exit muscles? cycles? equations? ISO EN DLMF"
    " Python MuJoCo Gymnasium MyoSuite commit seed reconnected rerun left right"
)
_LEFT_OUT = re.compile(
    "|".join(
        (
            r"^```.*?^```|^---$.*?^---$|<!--.*?-->",
            r"\$\$.*?\$\$|`[^`\n]*`|\$[^$\n]*\$|\]\([^)\n]*\)|<[^>\n]*>",
            r"^\s*\d+\. |\(\d{1,2}\)",
            r"\b(?:MAS|DMSP|X-ring|O-ring|January)[- ]?\d[\d-]*|\b10-\d\b|\b1/f\b|\b95 %",
            rf"\b(?i:{'|'.join(_NAMES.split())})\]? \d[\w.]*(?:(?:,| and| to) \d+)*",
            r"(?<![\d.,])(?:1[789]\d\d|20[0-4]\d)(?!\d|[.,]\d)",
        )
    ),
    re.MULTILINE | re.DOTALL,
)
_NUMBER = re.compile(r"(?<![\w.])\d(?:[\d,]*\d)?(?:\.\d+)?(?:e[-+]?\d+)?(?!\w*-\d)")


def numbers(text: str) -> list[tuple[int, int]]:
    """First and last place of every number outside code, formulas, links and names."""
    plain = _LEFT_OUT.sub(lambda found: " " * len(found[0]), text)
    return [found.span() for found in _NUMBER.finditer(plain)]


def changed(text: str, start: int, end: int) -> str:
    """The text with another last digit of a number's mantissa."""
    last = start + len(re.split("e", text[start:end])[0]) - 1
    return f"{text[:last]}{(int(text[last]) + 3) % 10}{text[last + 1 :]}"


@functools.cache
def sources() -> dict[str, list[dict[str, Any]]]:
    """Page -> texts of its lines, and the source of their numbers."""
    return tomllib.loads(STATED.read_text(encoding="utf-8"))


def stated(page: str, line: str) -> str:
    """The source that is stated for the numbers of a line; empty if none is."""
    for one in sources().get(page, ()):
        if any(text in line for text in one["text"]):
            return one["source"]
    return ""


class Guarded:
    """Runs the tests of a page on each of its changed texts."""

    def __init__(self, pages: list[str]) -> None:
        self.pages = pages
        self.rows: dict[str, list[tuple[int, str, str]]] = {}
        self._read: set[str] = set()
        self._failed = ""
        self._other: tuple[Path, str] | None = None

    def pytest_configure(self) -> None:
        """Watch what is read."""
        read = Path.read_text
        by_path = {path: name for name, path in PAGES.items()}

        def watched(path: Path, *args: object, **named: object) -> str:
            whole = path.resolve()
            if whole in by_path:
                self._read.add(by_path[whole])
            if self._other is not None and whole == self._other[0]:
                return self._other[1]
            return read(path, *args, **named)

        Path.read_text = watched

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep the name of a test that failed."""
        if report.failed:
            self._failed = report.nodeid

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Run all tests, then those of a page on each of its numbers."""
        of_page: dict[str, list[pytest.Item]] = {name: [] for name in self.pages}
        for item in tqdm(session.items, desc="tests", unit="test"):
            self._read, began = set(), time.perf_counter()
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)
            if self._failed:
                print(f"{self._failed} fails as the documents are, and holds no number to them")
                self._failed = ""
            elif time.perf_counter() - began < LONGEST:
                for name in self._read & of_page.keys():
                    of_page[name].append(item)
        for name, items in of_page.items():
            text = PAGES[name].read_text(encoding="utf-8")
            rows = self.rows[name] = []
            for start, end in tqdm(numbers(text), desc=name, unit="number"):
                line = text.count("\n", 0, start)
                test = self._fails(items, PAGES[name], changed(text, start, end))
                source = test or stated(name, text.splitlines()[line])
                rows.append((line + 1, text[start:end], source))
        return True

    def _fails(self, items: list[pytest.Item], path: Path, text: str) -> str:
        """The first test that fails if a page is another; empty if none does."""
        ours, theirs = os.pipe()
        if os.fork() == 0:
            os.close(ours)
            self._other = (path, text)
            for item in items:
                item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)
                if self._failed:
                    os.write(theirs, self._failed.encode())
                    break
            os._exit(0)
        os.close(theirs)
        with os.fdopen(ours) as pipe:
            name = pipe.read()
        os.wait()
        return name


def main() -> None:
    """Run, print, write."""
    asked = parser(__doc__)
    asked.add_argument("--pages", nargs="+", choices=PAGES, default=list(PAGES))
    options = asked.parse_args()
    found = Guarded(options.pages)
    quiet = [
        word for name in ("terminal", "cacheprovider", "xdist") for word in ("-p", f"no:{name}")
    ]
    plain = ["-o", "addopts=", "--import-mode=importlib", "-m", "not slow", "-k", LONG]
    files = (file for room in TESTS for file in sorted((ROOT / "tests" / room).rglob("test_*.py")))
    reading = [str(file) for file in files if READ.search(file.read_text(encoding="utf-8"))]
    pytest.main([*quiet, *plain, *reading], plugins=[found])
    pages: dict[str, dict[str, list[str]]] = {}
    without = 0
    for name, rows in found.rows.items():
        held = sum("::" in source for *_, source in rows)
        none = [(line, number) for line, number, source in rows if not source]
        without += len(none)
        print(f"{name:15} {len(rows):4} numbers, {held:4} held by a quick test, without: {none}")
        pages[name] = {}
        for line, number, source in rows:
            pages[name].setdefault(source, []).append(f"{line}: {number}")
    write(head("python scripts/doc_numbers.py") | {"pages": pages}, options.json)
    print(f"{without} without a source")
    sys.exit(int(without > 0))


if __name__ == "__main__":
    main()
