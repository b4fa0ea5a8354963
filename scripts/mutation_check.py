"""Whether the tests notice a slip in a law, a verdict rule, a page or a command: line by line.

    python scripts/mutation_check.py [PART ...] [--count 20] [--seed 0] [--json FILE]

A mutation changes one comparison, sign, factor, number or condition of a line, unless that only
states how wide, large or pale something is drawn. As many are drawn from each part: ``laws`` of
muscles, hysteresis and air; ``kernel``, the muscles' part of a step; ``engine``; ``effects``;
``learned``, curves of what has no name; ``verdict``, the rules by which recordings, tables at rest
and loops come to a verdict; ``identification``; ``papers``, their claims recomputed; ``report``,
figures and pages; ``sweeps``; ``cli``, the commands. Each is run by the tests of its room, those of
its file first, and is caught if one fails or takes too long. Survivors are listed with the line
before and after. It works on a copy of the repository: nothing here is touched. Where no mutation
of a room survived, its tests must pass in the end with nothing changed. FILE is written after each
mutation, and the same command goes on from it.
"""

from __future__ import annotations

import ast
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from records import parser, read, write
from tqdm import tqdm

ROOT = Path(__file__).resolve().parent.parent
LIMIT = 400  # on the processor time of a run of tests [s]; a mutation may make a search endless


@dataclass(frozen=True)
class Room:
    """Sources whose mutations the same tests are to notice.

    Attributes:
        sources: files and folders below ``pamsim``.
        tests: files, folders and tests below ``tests``, with blanks between, quickest first.
        left_out: files of the folders that state no law.
        own: longer ones, which run where they name the file, as those of a command do.
    """

    sources: tuple[str, ...]
    tests: tuple[str, ...]
    left_out: tuple[str, ...] = ()
    own: tuple[str, ...] = ()


_PAGES = "unit/tooling/test_theory_and_effects_pages.py::test_the_page_of_"
_FIELDS = f"{_PAGES}parameters_is_that_of_the_classes"
_ENGINE = "unit/engine integration/test_callback.py integration/test_laws_in_engine.py physics"
_OF_CLI = (
    "unit/tooling/test_commands.py unit/tooling/test_command_line.py"
    " unit/tooling/test_command_options.py unit/tooling/test_lists.py"
    " integration/test_command_line.py integration/test_import_command.py"
    " integration/test_hide_command.py integration/test_film_command.py"
)
_LONGER = (
    "integration/test_identify_command.py integration/test_check_command.py"
    " integration/test_fit.py integration/test_replicate.py unit/sweeps/test_documented_sweep.py"
    " integration/test_diagnose_command.py integration/test_calibrate_command.py"
)

PARTS = {
    "laws": Room(
        ("physics",),
        (_FIELDS, "unit/physics", "properties", _ENGINE),
        left_out=("invariants.py", "kernel.py"),
    ),
    "kernel": Room(
        ("physics/kernel.py", "engine/muscle_step.py", "engine/gauges.py"),
        ("unit/physics", _ENGINE),
    ),
    "engine": Room(
        ("engine",),
        (_ENGINE, "integration/test_own_physics.py unit/envs unit/recordings unit/sweeps"),
        left_out=("muscle_step.py", "gauges.py", "law_table.py", "function_table.py",
                  "by_address.py", "memory.py", "compiled.py", "jit.py"),
    ),
    "effects": Room(
        ("effects",),
        (f"{_PAGES}effects_is_that_of_the_catalog", "unit/effects",
         "unit/comparison physics/test_effects.py unit/diagnosis plant/test_hidden_effects.py"),
    ),
    "learned": Room(
        (
            "physics/spline.py", "physics/learned.py", "physics/learned_tension.py",
            "diagnosis/by_link/curve_places.py",
            "diagnosis/by_link/learned_entry.py", "diagnosis/by_link/visited_places.py",
            "diagnosis/by_link/curve_properties.py",
        ),
        (
            "unit/physics/test_learned_curves.py unit/diagnosis/by_link/test_curve_places.py"
            " unit/diagnosis/by_link/test_learned_entry.py",
            f"{_FIELDS} unit/diagnosis/by_link physics/test_effects.py",
        ),
    ),
    "verdict": Room(
        tuple(
            f"diagnosis/by_link/{name}.py"
            for name in ("judge", "judged", "held_out", "left_out", "limits", "search", "promise",
                         "sizes", "whole_chain", "diagnose_rest")
        ),
        ("unit/diagnosis/by_link/test_judgement.py unit/diagnosis/by_link/test_judge.py"
         " unit/diagnosis/by_link/test_sizes.py",
         "unit/diagnosis/by_link/test_rows_at_rest.py unit/diagnosis/by_link/test_loops.py"
         " unit/diagnosis/by_link/test_link_diagnosis.py",
         "unit/diagnosis unit/comparison"),
    ),
    "identification": Room(
        ("identification",),
        ("unit/identification unit/report/test_identify_page.py unit/controllers/test_pid.py"
         " integration/test_identify_command.py",),
    ),
    "papers": Room(
        ("papers",),
        ("unit/papers", "integration/test_replicate.py integration/test_reproduce.py"
         " integration/test_paper_benches.py unit/report/test_replication_figures.py"
         " unit/report/test_replication_page.py unit/report/test_reproduce_page.py"),
    ),
    "report": Room(
        ("report",),
        ("unit/report",),
        own=("integration/test_results.py unit/fitting/test_fit_result.py"
             " unit/identification/test_identify_result.py unit/diagnosis/by_link/test_result.py"
             " unit/sweeps/test_sweep.py integration/test_check_command.py"
             " integration/test_film_command.py",),
    ),
    "sweeps": Room(
        ("sweeps",),
        ("unit/sweeps/test_designs.py unit/sweeps/test_own_function.py"
         " unit/sweeps/test_runs_of_a_study.py unit/sweeps/test_sweep.py"
         " integration/test_command_line.py unit/sweeps/test_documented_sweep.py",),
    ),
    "cli": Room(("cli",), (_OF_CLI,), own=(_LONGER,)),
}  # fmt: skip

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

_STYLE = {
    *("alpha", "bbox_to_anchor", "borderaxespad", "capsize", "columnspacing", "elinewidth"),
    *("fontsize", "framealpha", "handlelength", "height_ratios", "labelsize", "linespacing"),
    *("linestyle", "linewidth", "linewidths", "markeredgewidth", "markersize", "nbins", "ncols"),
    *("rotation", "shrink", "size", "subs", "width_ratios", "xytext", "zorder"),
}
"""Arguments that state how a figure looks, and no number in it."""

_DASHES = [ast.Constant, ast.Tuple]
"""What matplotlib takes for dashes: where they begin, and their lengths."""


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
    """Every mutation of a file, relative to the repository, that stays within a line."""
    lines = text.encode().decode("latin-1").split("\n")  # a character for each byte, as ast counts
    for node in ast.walk(_in_effect(ast.parse(text))):
        for line, start, end, new in _replacements(node, lines):
            old = lines[line - 1]
            before, after = (
                one.encode("latin-1").decode().strip()
                for one in (old, old[:start] + new + old[end:])
            )
            if after != before:
                yield Mutation(str(path), line, before, after)


def _in_effect(tree: ast.Module) -> ast.Module:
    """The tree without annotations, which never run, and without the style of what is drawn."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            node.keywords = [one for one in node.keywords if one.arg not in _STYLE]
            if isinstance(node.func, ast.Name) and node.func.id == "new_figure":
                node.args = node.args[1:]  # but its height
        if isinstance(node, ast.Dict):
            node.values = [
                value
                for key, value in zip(node.keys, node.values, strict=True)
                if not (isinstance(key, ast.Constant) and _is_style(key.value))
            ]
        if isinstance(node, ast.Tuple) and [type(one) for one in node.elts] == _DASHES:
            node.elts = []
        if isinstance(node, ast.arg | ast.AnnAssign):
            node.annotation = None  # pyright: ignore[reportAttributeAccessIssue]
        if isinstance(node, ast.FunctionDef):
            node.returns = None
    return tree


def _is_style(key: object) -> bool:
    return isinstance(key, str) and key.rpartition(".")[2] in _STYLE


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
        yield node.lineno, node.col_offset, node.col_offset + len("not "), ""


def files_of(room: Room, module: str, copy: Path) -> list[str]:
    """Files and tests of a room in a copy of the repository.

    Those that name a module, such as ``sweeps.job``, come first.
    """
    named: dict[str, bool] = {}
    always = " ".join(room.tests).split()
    for name in (*always, *" ".join(room.own).split()):
        path = copy / "tests" / name
        for file in sorted(path.rglob("test_*.py")) if path.is_dir() else [path]:
            test = str(file.relative_to(copy))
            text = test + Path(copy, test.partition("::")[0]).read_text()
            own = module in text or f"/test_{module.rpartition('.')[2]}" in text
            if own or name in always:
                named[test] = own
    return sorted(named, key=lambda test: not named[test])


def failing(tests: list[str], copy: Path) -> str | None:
    """The first of the tests that fails in a copy of the repository.

    It fails once more by itself, for one that waits for a process may fail on a busy machine. Empty
    if they take too long, or nothing can be imported.

    Raises:
        SystemExit: if pytest finds no such test.
    """
    places = {"PYTHONPATH": str(copy), "NUMBA_CACHE_DIR": str(copy.parent / "numba")}
    pytest = (sys.executable, "-m", "pytest", "-q", "-x", "-n", "0", "-p", "no:cacheprovider")
    found = ""
    while True:
        run = subprocess.run(
            [*pytest, *([found] if found else tests)],
            cwd=copy,
            env=os.environ | places,
            capture_output=True,
            text=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT)),
        )
        if run.returncode == 0:
            return None
        if "ERROR: not found" in run.stderr or "ERROR: file or directory not found" in run.stderr:
            raise SystemExit(run.stderr.strip())
        named = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - |$)", run.stdout, re.MULTILINE)
        if found or not named:
            return found
        found = named[1]


def caught(mutation: Mutation, room: Room, copy: Path) -> str | None:
    """`failing` once the line is changed in a copy, which is put right again."""
    path = copy / mutation.file
    original = path.read_text()
    lines = original.splitlines(keepends=True)
    lines[mutation.line - 1] = lines[mutation.line - 1].replace(mutation.before, mutation.after)
    path.write_text("".join(lines))
    module = ".".join(Path(mutation.file).with_suffix("").parts[-2:])
    try:
        return failing(files_of(room, module, copy), copy)
    finally:
        path.write_text(original)


def possible(room: Room) -> list[Mutation]:
    """Every mutation of a room."""
    found: list[Mutation] = []
    for source in room.sources:
        path = ROOT / "pamsim" / source
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            if file.name not in room.left_out:
                found += mutations(file.relative_to(ROOT), file.read_text())
    return found


def check(part: str, count: int, seed: int, copy: Path, result: dict[str, Any]) -> Iterator[None]:
    """Draw mutations of a part at random and try each that a result does not hold yet.

    Args:
        part: see `PARTS`.
        count: how many.
        seed: random seed of the draw.
        copy: of the repository, in which they are tried.
        result: of the part so far, or empty; filled, and complete enough to keep at each step.

    Raises:
        SystemExit: if the result is of other sources, tests or options; if tests that noticed
            every mutation fail where nothing is changed, too.
    """
    room = PARTS[part]
    every = possible(room)
    drawn = random.Random(f"{seed} {part}").sample(every, min(count, len(every)))
    command = f"python scripts/mutation_check.py {part} --count {count} --seed {seed}"
    if not result:
        commit = _git("rev-parse", "--short", "HEAD")
        result |= {"command": command, "commit": commit, "possible": len(every)}
        result |= {"drawn": len(drawn), "tried": 0, "caught": 0, "survivors": []}
    if result["command"] != command or _git("diff", result["commit"], "--", "pamsim", "tests"):
        raise SystemExit(
            f"{part}: the sources, tests or options are not those of the result; remove the part"
            " from it to begin again"
        )
    for mutation in tqdm(drawn[result["tried"] :], desc=part, unit="mutation"):
        found = caught(mutation, room, copy)
        result["tried"] += 1
        result["caught"] += found is not None
        if found is None:
            result["survivors"].append(asdict(mutation))
        by = "SURVIVED" if found is None else found or "takes too long, or cannot be imported"
        tqdm.write(f"{mutation.file}:{mutation.line}: {mutation.after}\n    {by}")
        yield
    if not result["survivors"] and failing(files_of(room, "", copy), copy) is not None:
        raise SystemExit(f"{part}: the tests fail where nothing is changed")


def _git(*args: str) -> str:
    run = subprocess.run(("git", *args), cwd=ROOT, capture_output=True, text=True, check=True)
    return run.stdout.strip()


def main() -> None:
    """Read the arguments, check, print and write."""
    asked = parser(__doc__, count=20, seed=0)
    asked.add_argument("parts", nargs="*", default=list(PARTS), metavar="PART")
    given = asked.parse_args()
    if unknown := set(given.parts) - PARTS.keys():
        asked.error(f"no part {', '.join(unknown)}; there are {', '.join(PARTS)}")
    kept = read(given.json)
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "repository"
        skipped = shutil.ignore_patterns(".git", ".venv", "out", "build", "dist", ".*_cache")
        shutil.copytree(ROOT, copy, ignore=skipped)
        for part in given.parts:
            result = kept.setdefault(part, {})
            for _ in check(part, given.count, given.seed, copy, result):
                write(kept, given.json)
            print(f"{part}: {result['caught']} of {result['tried']} mutations caught", flush=True)


if __name__ == "__main__":
    main()
