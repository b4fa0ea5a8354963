"""Print every phrase of lint_words.toml in code, pages and documents, with what to write instead.

    python scripts/lint_words.py [PATH ...]

Reads comments, docstrings, messages and identifiers of Python files; all text of other files.
Exit status 1 if there is any such phrase.
"""

from __future__ import annotations

import re
import sys
import tokenize
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TABLE = Path(__file__).with_suffix(".toml")
SEARCHED = (
    "README.md", "CHANGELOG.md", "docs/*.md", "docs/**/*.py", "models/*/*.md",
    "models/*/params.toml", "Makefile", "pamsim/**/*.py", "pamsim/**/*.html", "scripts/**/*.py",
    "tests/**/*.py",
)  # fmt: skip
# From Python 3.12 on, an f-string is several tokens.
_TEXT = {"COMMENT", "STRING", "FSTRING_START", "FSTRING_MIDDLE", "FSTRING_END"}


@dataclass(frozen=True)
class Rule:
    """A phrase to avoid, looked for in lower case."""

    pattern: re.Pattern[str]
    write: str
    in_text: bool
    in_names: bool

    @classmethod
    def of(cls, row: dict[str, str | bool]) -> Rule:
        """The rule of one row of the table."""
        # A phrase may go on in the next line of a comment, of a docstring or of joined strings.
        words = str(row["find"]).replace(" ", r"(?:[\s_#\"'-]|\bf(?=[\"']))+")
        names = row.get("names", False)
        pattern = re.compile(rf"(?<![a-z])(?:{words})(?![a-z])")
        return cls(pattern, str(row["write"]), names != "only", bool(names))


def read_table(path: Path = TABLE) -> tuple[list[Rule], list[dict[str, str]]]:
    """Rules, and the exceptions from them."""
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    return [Rule.of(row) for row in table["rule"]], table.get("exception", [])


def split(path: Path) -> tuple[str, list[tuple[int, str]]]:
    """What is prose in a file, the rest blanked out line by line; and its identifiers by line."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        return text, []
    lines = [["|"] * len(line) for line in text.splitlines()]
    names: list[tuple[int, str]] = []
    source = text.splitlines()
    with path.open("rb") as file:
        for token in tokenize.tokenize(file.readline):
            if token.type == tokenize.NAME:
                names.append((token.start[0], token.string))
            elif tokenize.tok_name[token.type] in _TEXT:
                for row in range(token.start[0], token.end[0] + 1):
                    first = token.start[1] if row == token.start[0] else 0
                    last = token.end[1] if row == token.end[0] else len(source[row - 1])
                    lines[row - 1][first:last] = source[row - 1][first:last]
    # Indentation is no code: a comment or a string may go on after it.
    prose = ["".join(line) for line in lines]
    indents = [len(line) - len(line.lstrip()) for line in source]
    return "\n".join(" " * n + line[n:] for n, line in zip(indents, prose, strict=True)), names


def snake(name: str) -> str:
    """An identifier in lower case with underscores: HeldInput -> held_input."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def phrases(path: Path, rules: list[Rule]) -> Iterator[tuple[int, str, str]]:
    """Line, phrase and what to write instead; an identifier is given where it first stands."""
    prose, names = split(path)
    prose = prose.lower()
    first = {snake(name): (line, name) for line, name in reversed([(1, path.stem), *names])}
    for rule in rules:
        if rule.in_text:
            for match in rule.pattern.finditer(prose):
                yield prose.count("\n", 0, match.start()) + 1, match[0], rule.write
        if rule.in_names:
            for words, (line, name) in first.items():
                if rule.pattern.search(words):
                    yield line, name, rule.write


def spared(where: str, phrase: str, exceptions: list[dict[str, str]]) -> bool:
    """Whether the table excepts this phrase in this file."""
    return any(
        Path(where).match(e["file"]) and re.fullmatch(e["phrase"], phrase, re.IGNORECASE)
        for e in exceptions
    )


def main(arguments: list[str]) -> int:
    """Print what is to be rewritten; 1 if there is any."""
    rules, exceptions = read_table()
    own = {Path(__file__).resolve(), ROOT / "tests/unit/tooling/test_lint_words.py"}
    paths = [Path(a).resolve() for a in arguments] or [
        path for pattern in SEARCHED for path in sorted(ROOT.glob(pattern))
    ]
    files = [f for p in paths for f in (sorted(p.rglob("*.*")) if p.is_dir() else [p])]
    known = {".py", ".html", ".md", ".toml", ""}
    count = 0
    for path in files:
        if path in own or path == TABLE or path.suffix not in known:
            continue
        where = path.relative_to(ROOT).as_posix()
        for line, phrase, write in sorted(phrases(path, rules)):
            if not spared(where, phrase, exceptions):
                count += 1
                print(f"{where}:{line}: {' '.join(phrase.split())} -> {write}")
    return int(count > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
