"""Whether the tests notice a slip: one-line mutations, each run by the tests that reach it.

    python scripts/mutation_check.py [ROOM ...] [--count 60] [--seed 0] [--tests PATH ...]
        [--json FILE]

A mutation changes one comparison, sign, factor, number or condition in a line that tests execute.
Which tests reach a line is measured first, by pytest-cov, and kept in out/mutation_coverage until
that folder is removed; --tests measures by these files and folders alone, which is quicker. A
mutation is caught if one of those tests fails or does not end in time; survivors are listed with
the line before and after. It works on a copy of the repository: nothing here is touched.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import coverage
from tqdm import tqdm

ROOT = Path(__file__).resolve().parent.parent
COVERAGE = ROOT / "out" / "mutation_coverage"
ROOMS = ("inference", "comparison", "calibration", "diagnosis", "fitting", "linear", "effects")
TIMEOUT = 300.0  # of the tests of one mutation [s]; a mutation may make a search endless

PYTEST = (sys.executable, "-m", "pytest", "-q")
_MEASURED = ("--cov=pamsim", "--cov-context=test", "--cov-report=")

_SWAPS: dict[type[ast.AST], tuple[str, str]] = {
    ast.Lt: ("<", ">="),
    ast.LtE: ("<=", ">"),
    ast.Gt: (">", "<="),
    ast.GtE: (">=", "<"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.And: ("and", "or"),
    ast.Or: ("or", "and"),
}


@dataclass(frozen=True)
class Mutation:
    """One changed line.

    Attributes:
        file: relative to the repository.
        line: its number, from 1.
        before: the line as it is.
        after: the line as mutated.
    """

    file: str
    line: int
    before: str
    after: str


def mutations(path: Path, text: str) -> Iterator[Mutation]:
    """Every mutation of a file that stays within a line.

    Args:
        path: of the file, relative to the repository.
        text: its source.
    """
    lines = text.splitlines()
    for node in ast.walk(_without_annotations(ast.parse(text))):
        for line, start, end, new in _replacements(node, lines):
            before = lines[line - 1]
            after = before[:start] + new + before[end:]
            if after != before:
                yield Mutation(str(path), line, before.strip(), after.strip())


def _without_annotations(tree: ast.Module) -> ast.Module:
    """The tree without annotations, which never run."""
    for node in ast.walk(tree):
        if isinstance(node, ast.arg | ast.AnnAssign):
            node.annotation = None  # pyright: ignore[reportAttributeAccessIssue]
        if isinstance(node, ast.FunctionDef):
            node.returns = None
    return tree


def _replacements(node: ast.AST, lines: list[str]) -> Iterator[tuple[int, int, int, str]]:
    """(line, first column, end column, new text) of what a node may become."""
    pairs: list[tuple[ast.expr, ast.AST, ast.expr]] = []
    if isinstance(node, ast.Compare):
        lefts = [node.left, *node.comparators]
        pairs = list(zip(lefts, node.ops, lefts[1:], strict=False))
    elif isinstance(node, ast.BinOp):
        pairs = [(node.left, node.op, node.right)]
    elif isinstance(node, ast.BoolOp):
        pairs = [(a, node.op, b) for a, b in zip(node.values, node.values[1:], strict=False)]
    for left, operator, right in pairs:
        swap = _SWAPS.get(type(operator))
        if swap is None or left.end_lineno != right.lineno or left.end_col_offset is None:
            continue
        line, begin, end = right.lineno, left.end_col_offset, right.col_offset
        between = lines[line - 1][begin:end]
        place = between.find(swap[0])
        if place >= 0:
            yield line, begin + place, begin + place + len(swap[0]), swap[1]
    if (
        isinstance(node, ast.Constant)
        and type(node.value) in (int, float)
        and node.end_col_offset is not None
    ):
        new = repr(node.value + 1 if isinstance(node.value, int) else 1.5 * node.value + 0.1)
        yield node.lineno, node.col_offset, node.end_col_offset, new
    if (
        isinstance(node, ast.UnaryOp)
        and isinstance(node.op, ast.Not)
        and node.operand.lineno == node.lineno
    ):
        yield node.lineno, node.col_offset, node.operand.col_offset, ""


def measured_coverage(tests: list[str]) -> coverage.CoverageData:
    """Which tests reach which line, from a run of these tests; kept for the next time."""
    kept = COVERAGE / ".coverage"
    if not kept.exists():
        COVERAGE.mkdir(parents=True, exist_ok=True)
        subprocess.run(
            [*PYTEST, "-n", "2", "--dist", "loadfile", *_MEASURED, *tests],
            cwd=ROOT,
            env=_environment(ROOT, COVERAGE_FILE=str(kept)),
            check=True,
        )
    data = coverage.CoverageData(basename=str(kept))
    data.read()
    return data


def reached_by(data: coverage.CoverageData) -> dict[str, dict[int, list[str]]]:
    """File -> line -> node ids of the tests that execute it, outside of imports."""
    reached: dict[str, dict[int, list[str]]] = {}
    for file in data.measured_files():
        tests = {
            line: sorted({re.sub(r"\|\w+$", "", context) for context in contexts if context})
            for line, contexts in data.contexts_by_lineno(file).items()
        }
        reached[str(Path(file).resolve().relative_to(ROOT))] = {k: v for k, v in tests.items() if v}
    return reached


def caught(mutation: Mutation, tests: list[str], copy: Path) -> bool:
    """Whether a test fails once the line is changed.

    Args:
        mutation: to apply.
        tests: node ids of the tests that reach the line.
        copy: repository to change and to put right again.
    """
    path = copy / mutation.file
    original = path.read_text()
    lines = original.splitlines(keepends=True)
    lines[mutation.line - 1] = lines[mutation.line - 1].replace(mutation.before, mutation.after)
    path.write_text("".join(lines))
    try:
        run = subprocess.run(
            [*PYTEST, "-x", "-n", "0", "-p", "no:cacheprovider", *tests],
            cwd=copy,
            env=_environment(copy),
            capture_output=True,
            timeout=TIMEOUT,
        )
        return run.returncode != 0
    except subprocess.TimeoutExpired:
        return True
    finally:
        path.write_text(original)


def _environment(root: Path, **more: str) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(root), **more}


def check(rooms: list[str], count: int, seed: int, tests: list[str]) -> dict[str, Any]:
    """Draw mutations at random and try each.

    Args:
        rooms: of pamsim, to draw from.
        count: how many.
        seed: random seed of the draw.
        tests: files and folders of the tests that count; all if empty.
    """
    reached = reached_by(measured_coverage(tests))
    files = [f for room in rooms for f in sorted((ROOT / "pamsim" / room).rglob("*.py"))]
    every = [
        m
        for file in files
        for m in mutations(file.relative_to(ROOT), file.read_text())
        if m.line in reached.get(m.file, {})
    ]
    drawn = random.Random(seed).sample(every, min(count, len(every)))
    survivors: list[Mutation] = []
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "repository"
        skipped = shutil.ignore_patterns(".git", ".venv", "out", "build", "dist", ".*_cache")
        shutil.copytree(ROOT, copy, ignore=skipped)
        for mutation in tqdm(drawn, unit="mutation"):
            if not caught(mutation, reached[mutation.file][mutation.line], copy):
                survivors.append(mutation)
                tqdm.write(f"{mutation.file}:{mutation.line}: {mutation.after}")
    return {
        "command": f"python scripts/mutation_check.py {' '.join(rooms)}"
        f" --count {count} --seed {seed}" + (f" --tests {' '.join(tests)}" if tests else ""),
        "possible": len(every),
        "tried": len(drawn),
        "caught": len(drawn) - len(survivors),
        "survivors": [asdict(m) for m in survivors],
    }


def main() -> None:
    """Read the arguments, check, print and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rooms", nargs="*", default=list(ROOMS), metavar="ROOM")
    parser.add_argument("--count", type=int, default=60, help="mutations to try")
    parser.add_argument("--seed", type=int, default=0, help="random seed of the draw")
    parser.add_argument("--tests", nargs="+", default=[], help="files and folders; all if left out")
    parser.add_argument("--json", type=Path, help="write the result here")
    given = parser.parse_args()
    result = check(given.rooms, given.count, given.seed, given.tests)
    print(f"{result['caught']} of {result['tried']} mutations caught")
    if given.json:
        given.json.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
