"""Lines and files per room of the package, and how many modules each command imports.

    python scripts/house_report.py [FOLDER]

FOLDER is a checkout, this one if left out. Imports are followed in the source, those inside
functions included; type-checking imports, which never run, are not.
"""

from __future__ import annotations

import ast
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path


def module_name(root: Path, file: Path) -> str:
    """Dotted name of a module of a checkout."""
    return ".".join(file.relative_to(root).with_suffix("").parts).removesuffix(".__init__")


def imported(tree: ast.AST) -> Iterator[str]:
    """Dotted names that a module imports: modules, and names that may be modules."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        yield from imported(node)


def closure(start: str, imports: dict[str, set[str]]) -> set[str]:
    """Modules that a module imports, directly or through others."""
    reached: set[str] = set()
    waiting = [start]
    while waiting:
        new = imports[waiting.pop()] - reached
        reached |= new
        waiting += new
    return reached


def main(arguments: list[str]) -> None:
    """Print both tables."""
    root = Path(arguments[0] if arguments else Path(__file__).parents[1]).resolve()
    files = {module_name(root, file): file for file in sorted(root.glob("pamsim/**/*.py"))}
    source = {name: file.read_text(encoding="utf-8") for name, file in files.items()}
    lines, count = Counter[str](), Counter[str]()
    for name, file in files.items():
        room = file.relative_to(root).parts[1] if len(file.relative_to(root).parts) > 2 else "."
        lines[room] += source[name].count("\n")
        count[room] += 1
    for room, total in lines.most_common():
        print(f"{room:16s} {total:6d} lines {count[room]:4d} files")
    print(f"{'all':16s} {lines.total():6d} lines {count.total():4d} files\n")

    imports = {
        name: {other for other in imported(ast.parse(text)) if other in files and other != name}
        for name, text in source.items()
    }
    commands = [name for name in files if name.startswith("pamsim.cli.")]
    sizes = {name: len(closure(name, imports)) for name in commands}
    for name in sorted(sizes, key=lambda each: -sizes[each]):
        print(f"{name:24s} imports {sizes[name]:4d} modules")


if __name__ == "__main__":
    main(sys.argv[1:])
