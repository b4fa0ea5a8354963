"""Every number that the rooms of the diagnosis are written with, and its reason.

    python scripts/constants.py

prints a Markdown table of the module-level numbers of effects, inference, comparison, diagnosis,
twins, calibration and fitting: where it stands, its value, the comment or docstring beside it, and
whether it decides what a diagnosis concludes, or what it tries. The others are tolerances of
numerical methods, limits of memory and effort, and the conventions by which experiments are made
and results written.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = ("effects", "inference", "comparison", "diagnosis", "twins", "calibration", "fitting")

RULES = {
    "by_link/judged.py": ("EXPLAINED", "BESIDE_OTHERS", "NAMED", "SERIES"),
    "by_link/link_fit.py": ("_SEEN", "PRIOR"),
    "by_link/judged_units.py": ("VARIATION",),
    "by_link/limits.py": ("ALPHA", "MATERIAL", "LEAST"),
    "by_link/judge.py": ("_RIVALS",),
    "by_link/search.py": (
        "_OF_LEFT", "CONTENDS", "WORTH", "MOST, _FORMS",
    ),
}  # fmt: skip
"""File of the diagnosis -> numbers on which its conclusions depend."""


@dataclass(frozen=True)
class Constant:
    """A number, or some, by which a module is written.

    Attributes:
        file: below the package.
        names: of the numbers.
        value: as written.
        reason: comment or docstring beside it; empty if there is none.
    """

    file: str
    names: str
    value: str
    reason: str

    @property
    def is_rule(self) -> bool:
        """Whether what a diagnosis concludes depends on it."""
        return any(self.file.endswith(f) and self.names in names for f, names in RULES.items())


def constants() -> Iterator[Constant]:
    """All of them, by room and file."""
    for room in ROOMS:
        for path in sorted((ROOT / "pamsim" / room).rglob("*.py")):
            text = path.read_text(encoding="utf-8")
            body = ast.parse(text).body
            for node, after in zip(body, [*body[1:], None], strict=True):
                if not isinstance(node, ast.Assign | ast.AnnAssign) or not _number(node.value):
                    continue
                target = node.target if isinstance(node, ast.AnnAssign) else node.targets[0]
                assert node.value is not None
                yield Constant(
                    file=path.relative_to(ROOT / "pamsim").as_posix(),
                    names=ast.unparse(target).strip("()"),
                    value=ast.unparse(node.value),
                    reason=_reason(text.splitlines(), node, after),
                )


def _number(node: ast.AST | None) -> bool:
    """Whether an expression is of numbers alone."""
    match node:
        case ast.Constant(value=value):
            return isinstance(value, int | float) and not isinstance(value, bool)
        case ast.Tuple(elts=parts) | ast.List(elts=parts):
            return bool(parts) and all(map(_number, parts))
        case ast.UnaryOp(operand=operand):
            return _number(operand)
        case ast.BinOp(left=left, right=right):
            return _number(left) and _number(right)
        case ast.Call(func=ast.Attribute(value=ast.Name(id="np")), args=parts):
            return bool(parts) and all(map(_number, parts))
        case _:
            return False


def _reason(lines: list[str], node: ast.stmt, after: ast.stmt | None) -> str:
    if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
        return " ".join(inspect.cleandoc(str(after.value.value)).split())
    beside = lines[(node.end_lineno or node.lineno) - 1].partition("#")[2].strip()
    above: list[str] = []
    for line in reversed(lines[: node.lineno - 1]):
        if not line.startswith("#"):
            break
        above.insert(0, line.lstrip("# "))
    return beside or " ".join(above)


def main() -> None:
    """Print the table."""
    print("| file | number | value | reason | rule |\n|---|---|---|---|---|")
    for one in constants():
        rule = "yes" if one.is_rule else ""
        print(f"| {one.file} | `{one.names}` | {one.value} | {one.reason} | {rule} |")


if __name__ == "__main__":
    main()
