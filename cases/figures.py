"""Numbers and times in words for users: ``33.7 µs``, ``1.24 M``, ``2 min 05 s``. All packages of Conoid use this
module.

The module ``client/web/figures.js`` writes numbers in the same way for the page; ``tests/figures.json`` has inputs and
texts that hold for both modules.
"""

import math
from collections.abc import Iterable, Sequence
from datetime import datetime
from decimal import ROUND_HALF_UP, Decimal

_Ladder = Sequence[tuple[float, str]]
"""Factors and their unit names, the largest factor first. A value is written in the first unit whose factor is not
above the value."""
_UP: _Ladder = ((1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k"))
_DOWN: _Ladder = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p"))
_PREFIXED = ("m", "g", "J", "Pa", "N", "W", "B", "Hz", "m/s", "N s", "N m", "J/m^2", "B/s")
"""Units that may have any SI prefix. All other units contain a prefix or a power, or are not physical units."""
_LADDERS: dict[str, _Ladder] = {
    **{unit: [(factor, prefix + unit) for factor, prefix in (*_UP, *_DOWN)] for unit in _PREFIXED},
    "s": [(factor, f"{prefix}s") for factor, prefix in _DOWN],
    "kg": [(1.0, "kg"), (1e-3, "g"), (1e-6, "mg"), (1e-9, "µg")],
    "m^2": [(1e-2, "m^2"), (1e-8, "mm^2"), (1e-12, "µm^2")],
    "m^3": [(1e-3, "m^3"), (1e-12, "mm^3"), (1e-18, "µm^3")],
}
_WORTH = {"m^2": 1.0, "mm^2": 1e-6, "µm^2": 1e-12, "m^3": 1.0, "mm^3": 1e-9, "µm^3": 1e-18}
"""Smallest value that is written in each unit of area and volume, SI, where it differs from the factor of the unit."""
_PLAIN = 1e-3, 5
"""Range of decimal exponents for which a number is written without a power of ten (chosen values). The upper end limits
the number of digits before the decimal point."""
_MOST = 1e12
"""Smallest whole number that is written with a power of ten, because five groups of digits are hard to read (chosen
value)."""
_MOST_HOURS = 10_000
"""Hours of wall time from which on minutes are not written: about a year (chosen value)."""
UNKNOWN = "–"
"""Text that stands for an unknown number."""


# Numbers with a unit --------------------------------------------------------------------------------------------------


def si(value: float | None, unit: str = "", digits: int = 3) -> str:
    """Returns ``value`` with ``digits`` significant digits and its unit; the unit gets an SI prefix if it accepts
    prefixes. A number without a unit has no prefix. An unknown value is written as a dash.
    """
    return alike([value], unit, digits)[0]


def exact(value: float | None, unit: str = "", digits: int = 6) -> str:
    """Returns the text that ``si`` returns, without zeros at the end of the number."""
    return _trimmed(si(value, unit, digits))


def alike(values: Iterable[float | None], unit: str = "", digits: int = 3) -> list[str]:
    """Returns the texts of values that are shown together, such as a column of a table; all texts have the prefix of
    the largest value.
    """
    known = [math.nan if value is None else float(value) for value in values]
    worth, name = shared_unit(known, unit, digits)
    return [_with(_number(value / worth, digits), name) if not math.isnan(value) else UNKNOWN for value in known]


def exacts(values: Iterable[float | None], unit: str = "", digits: int = 6) -> list[str]:
    """Returns the texts that ``alike`` returns, without zeros at the end of the numbers."""
    return [_trimmed(text) for text in alike(values, unit, digits)]


def vector(values: Iterable[float | None], unit: str = "", digits: int = 3, between: str = ", ") -> str:
    """Returns the components of a vector with the unit written once: ``1, 200 mm``."""
    return vectors([values], unit, digits, between)[0]


def vectors(rows: Iterable[Iterable[float | None]], unit: str = "", digits: int = 3, between: str = ", ") -> list[str]:
    """Returns the texts of several vectors, such as a column of a table; all texts have the same prefix."""
    known = [[math.nan if value is None else float(value) for value in row] for row in rows]
    worth, name = shared_unit([value for row in known for value in row], unit, digits)
    return [_with(between.join(_trimmed(_number(value / worth, digits)) for value in row), name) for row in known]


def large(value: float | None) -> str:
    """Returns a number without a unit, with k, M, G or T if the number is large: ``1.24 M``. A small prefix, such as m,
    is never used.
    """
    known = math.nan if value is None else float(value)
    worth, name = _step(abs(known), (*_UP, (1.0, "")), 3)
    return _with(_number(known / worth, 3), name)


def shared_unit(values: Sequence[float], unit: str, digits: int = 3) -> tuple[float, str]:
    """Returns the common factor of the unit of all values, and the name of the unit: the unit in which values are
    written side by side, such as the ticks of an axis.
    """
    most = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    if unit not in _LADDERS or most == 0.0:
        return 1.0, unit
    factor, name = _step(most, _LADDERS[unit], digits)
    return _WORTH.get(name, factor), name


def _step(most: float, ladder: _Ladder, digits: int) -> tuple[float, str]:
    """Returns the first factor and unit of ``ladder`` whose factor is not above ``most`` rounded to ``digits`` digits;
    the last entry if there is none.
    """
    return next((step for step in ladder if most >= step[0] * (1.0 - 0.5 * 10.0**-digits)), ladder[-1])


def _with(text: str, unit: str) -> str:
    return f"{text} {unit}".strip() if text != UNKNOWN else text


# Numbers --------------------------------------------------------------------------------------------------------------


def number(value: float | None) -> str:
    """Returns a number with six significant digits, for tables; a dash for an unknown value."""
    return exact(value)


def rough(value: float | None) -> str:
    """Returns a number with two significant digits and the power of ten, for residuals; a dash for an unknown value."""
    if value is None or not math.isfinite(value) or value == 0.0:
        return _number(math.nan if value is None else value, 2)
    return _power(value, 2)


def fixed(value: float | None, decimals: int = 2) -> str:
    """Returns a number with a fixed number of decimals, for ratios; a dash for an unknown value."""
    return UNKNOWN if value is None or not math.isfinite(value) else _fixed(value, decimals)


def percent(share: float | None, decimals: int = 1) -> str:
    """Returns a fraction as a percentage: ``12.3 %``."""
    text = fixed(None if share is None else 100.0 * share, decimals)
    return text if text == UNKNOWN else f"{text} %"


def count(value: float | None) -> str:
    """Returns a whole number with spaces between thousands: ``12 400``. From 10^12 on the text has a power of ten,
    ``2.40e21``; an unknown value is a dash.
    """
    if value is None or not math.isfinite(value):
        return UNKNOWN
    if abs(value) >= _MOST:
        return _power(value, 3)
    return f"{int(_fixed(value, 0)):,}".replace(",", " ")


def counted(value: float | None, noun: str, plural: str = "") -> str:
    """Returns a count with its noun: ``1 fragment``, ``12 400 fragments``; ``plural`` is needed if the plural is not
    the noun with an s.
    """
    return f"{count(value)} {noun if value == 1 else plural or f'{noun}s'}"


def crew(ranks: int, threads: int = 1) -> str:
    """Returns the ranks and threads of a run as text: ``2 ranks``, ``1 rank x 16 threads``."""
    return counted(ranks, "rank") + (f" x {counted(threads, 'thread')}" if threads > 1 else "")


def size(value: float | None) -> str:
    """Returns a number of bytes as text: ``38.2 GB``."""
    return si(value, "B")


def _number(value: float, digits: int) -> str:
    """Returns a number with ``digits`` significant digits, with a power of ten if the number is very small or large
    (_PLAIN).
    """
    if not math.isfinite(value):
        return UNKNOWN if math.isnan(value) else "∞" if value > 0 else "-∞"
    if value == 0.0:
        return "0"
    power = int(_power(value, digits).partition("e")[2])
    if abs(value) < _PLAIN[0] or power >= max(_PLAIN[1], digits):
        return _power(value, digits)
    return _fixed(value, max(0, digits - 1 - power))


def _fixed(value: float, decimals: int) -> str:
    """Rounds half away from zero, as the function toFixed of JavaScript does on the page."""
    if abs(value) >= 1e20:
        return _power(value, 3)
    text = f"{Decimal(value).quantize(Decimal(1).scaleb(-decimals), ROUND_HALF_UP):f}"
    return text if text.strip("-0.") else text.removeprefix("-")


def _power(value: float, digits: int) -> str:
    """Returns a number with a power of ten: ``5.43e-6``."""
    exact = Decimal(value)
    power = exact.adjusted()
    first = exact.scaleb(-power).quantize(Decimal(1).scaleb(1 - digits), ROUND_HALF_UP)
    if abs(first) >= 10:
        first, power = first.scaleb(-1).quantize(Decimal(1).scaleb(1 - digits)), power + 1
    return f"{first}e{power}"


def _trimmed(text: str) -> str:
    """Removes zeros at the end of a number behind the decimal point."""
    digits, power, unit = _parts(text)
    return f"{digits.rstrip('0').rstrip('.') if '.' in digits else digits}{power}{unit}"


def _parts(text: str) -> tuple[str, str, str]:
    """Returns the three pieces of a text: the digits, the power of ten from its letter e on, and the unit with the
    space before it.
    """
    shown, space, unit = text.partition(" ")
    digits, e, power = shown.partition("e")
    return digits, e + power, space + unit


# Times ----------------------------------------------------------------------------------------------------------------


def duration(seconds: float | None) -> str:
    """Returns a wall time as text: ``0.4 s``, ``42 s``, ``2 min 05 s``, ``3 h 04 min``; a dash for an unknown value."""
    if seconds is None or not math.isfinite(seconds) or seconds < 0:
        return UNKNOWN
    if seconds < 9.95:
        return f"{_fixed(seconds, 1)} s"
    if seconds >= 3600 * _MOST_HOURS:
        return f"{_number(seconds / 3600, 3)} h"
    whole = int(_fixed(seconds, 0))
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def clock(wall: float) -> str:
    """Returns the time of day of a Unix time, in the local time zone: ``14:03:27``."""
    return _moment(wall, "%H:%M:%S")


def day(wall: float) -> str:
    """Returns date and time of a Unix time, in the local time zone: ``21 Nov 14:03``; for another year
    ``2025-11-21``.
    """
    return _moment(wall, "%d %b %H:%M" if _moment(wall, "%Y") == f"{datetime.now().year}" else "%Y-%m-%d")


def _moment(wall: float, form: str) -> str:
    """Returns a date or time as text; a dash for a time outside of the calendar."""
    try:
        return datetime.fromtimestamp(wall).strftime(form)
    except (OverflowError, OSError, ValueError):
        return UNKNOWN
