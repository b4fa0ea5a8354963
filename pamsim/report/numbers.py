"""Numbers as readers expect them: a true minus sign, enough digits, a dash where there is none.

What is no number, and NaN, is written as a dash.
`pamsim.report.page` offers these functions to every template as filters of the same names.
"""

from __future__ import annotations

import math
import re
from typing import Any

from pamsim.core.digits import FEWEST_DIGITS, SMALLEST_P, significant_digits

NONE = "–"
PEOPLE = {
    "bouc wen": "Bouc-Wen",
    "coulomb": "Coulomb",
    "dahl": "Dahl",
    "lugre": "LuGre",
    "maxwell": "Maxwell",
    "mckibben": "McKibben",
    "mooney rivlin": "Mooney-Rivlin",
    "prandtl ishlinskii": "Prandtl-Ishlinskii",
    "preisach": "Preisach",
    "stribeck": "Stribeck",
}
"""Words of names in the catalogues -> how the people in them are written."""

_PEOPLE = rf"\b(?:{'|'.join(PEOPLE)})\b"
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number_or_none(value: Any) -> float | None:
    """Read a number of a JSON result; what is missing or not finite becomes None."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value) + 0.0  # without the sign of -0


def fixed(value: Any, decimals: int) -> str:
    """Write a number with so many decimals, such as ``−1.50``."""
    number = number_or_none(value)
    if number is None:
        return NONE
    text = f"{number:.{decimals}f}"
    if float(text) == 0.0:
        text = text.removeprefix("-")  # the sign of -0.00 means nothing
    return text.replace("-", "−")


def significant(value: Any, digits: int) -> str:
    """Write a number with so many significant digits: ``0.0900``, ``85.80``, ``1.20×10⁻⁸``.

    Trailing zeros are kept; digits before the point are never dropped, as in ``22150``.
    """
    number = number_or_none(value)
    if number is None:
        return NONE
    text = f"{number:#.{digits}g}"
    if 10**digits <= abs(float(text)) and abs(number) < 1e6:  # 99.6 of two digits is 100
        return fixed(number, 0)
    return _pretty(text)


def plain(value: Any) -> str:
    """Write a number as short as it was given, up to seven digits: for settings and print.

    For example ``0.64595``, ``24000``, and ``yes`` for True; text is returned as it is.
    """
    if value is None:
        return NONE
    if isinstance(value, bool):
        return "yes" if value else "no"
    number = number_or_none(value)
    return str(value) if number is None else _pretty(f"{number:.7g}")


def interval(pair: Any, digits: int) -> str:
    """Write an interval, such as ``0.668 to 0.676``; nothing if an end does not exist."""
    if not isinstance(pair, list | tuple) or len(pair) != 2:
        return ""
    ends = [significant(end, digits) for end in pair]
    return "" if NONE in ends else " to ".join(ends)


def digits(value: Any, pair: Any) -> int:
    """Significant digits of a value and its interval, see `significant_digits`."""
    numbers = [number_or_none(one) for one in (value, *(pair or ()))]
    known = [one for one in numbers if one is not None]
    return significant_digits(known[0], known[1:]) if len(known) == 3 else FEWEST_DIGITS


def quantity(value: Any, of: Any, digits: int) -> str:
    """Write a number with its unit, such as ``487.0 kPa``; see `significant` and `unit`."""
    text = significant(value, digits)
    return text if text == NONE else f"{text} {unit(of)}".rstrip()


def percent(share: Any, decimals: int = 0) -> str:
    """Write a share as a percentage, such as ``93 %``; a dash where there is none."""
    number = number_or_none(share)
    return NONE if number is None else f"{fixed(100.0 * number, decimals)} %"


def p_value(value: Any, least: float = 0.0) -> str:
    """Write a p-value, such as ``0.013``; a very small one as a bound, ``< 0.0001``.

    One at the ``least`` that so few trials or permutations can give is a bound, too: ``≤ 0.00098``.
    """
    number = number_or_none(value)
    if number is not None and number < SMALLEST_P:
        return f"< {SMALLEST_P:.4f}"
    floors = (least, SMALLEST_P)
    bound = number is not None and any(math.isclose(number, one, rel_tol=1e-9) for one in floors)
    return f"≤ {significant(number, 2)}" if bound else significant(number, 2)


def p_is(value: Any, least: float = 0.0) -> str:
    """Write a p-value in a sentence or title: ``p = 0.013``, ``p < 0.0001``; see `p_value`."""
    written = p_value(value, least)
    return f"p {written}" if written[0] in "<≤" else f"p = {written}"


def unit(name: Any) -> str:
    """Write a unit of a rig file as printed: ``dm^3/(s*bar)`` becomes ``dm³/(s·bar)``.

    It is empty for ``1`` and None.
    """
    if name is None or str(name) == "1":
        return ""
    raised = re.sub(r"(?:\^|\*\*)(-?\d+)", lambda power: power[1].translate(_RAISED), str(name))
    return re.sub(r"\bpercent\b", "%", raised).replace("*", "·")


def words(name: Any) -> str:
    """Turn an identifier such as ``output_error``, ``knee.angle`` or ``leak:laminar`` into words.

    What is named after a person gets a capital letter: ``coulomb_friction`` is Coulomb friction.
    """
    spaced = "" if name is None else re.sub(r"_|(?<=\w)\.(?=[a-z])", " ", str(name))
    spaced = re.sub(r"(?<=\w):(?=\w)", ": ", spaced)
    return re.sub(_PEOPLE, lambda found: PEOPLE[found[0]], spaced)


def sentence(text: Any) -> str:
    """Write a statement as a sentence: a capital first letter and one full stop.

    A name that comes first stands as it is: ``short/step_1: ...``, ``payload: ...``.
    """
    stated = "" if text is None else str(text).strip().rstrip(".")
    if re.match(r"[a-z][a-z'-]*[,;]?(?: |$)", stated):
        stated = f"{stated[:1].upper()}{stated[1:]}"
    return f"{stated}." if stated else ""


def _pretty(text: str) -> str:
    mantissa, _, exponent = text.partition("e")
    mantissa = mantissa.removesuffix(".").replace("-", "−")
    if not exponent:
        return mantissa
    return f"{mantissa}×10{str(int(exponent)).translate(_RAISED)}"


FILTERS = (fixed, significant, plain, interval, digits, quantity, percent, p_value, p_is, unit,
           words, sentence)  # fmt: skip
"""What templates may write numbers with."""
