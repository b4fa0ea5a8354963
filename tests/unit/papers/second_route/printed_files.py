"""Printed numbers of the papers as their files hold them, read without the package's readers."""

import csv
from importlib.resources import files

_FOLDER = files("pamsim") / "data"


def rows(file):
    """Rows of a printed table, column -> text."""
    lines = (_FOLDER / file).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def column(table, name):
    """One column as numbers."""
    return [float(row[name]) for row in table]
