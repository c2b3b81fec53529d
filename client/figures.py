"""Numbers and times as people read them: ``33.7 µs``, ``1.24 M``, ``2 min 05 s``."""

import math
from datetime import datetime

_PREFIXES = ((1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
"""SI."""
_MOST = 1e12
"""From which on a whole number is written with its power of ten. Chosen: nobody reads five groups of digits."""
_MOST_HOURS = 10_000
"""From which on minutes are left out. Chosen: a year."""
_SHOWN = 5e-3, 1e4
"""Before a prefix: less is 0.00 of the smallest one, more has five digits of the largest before the point."""


def si(value: float, unit: str, digits: int = 3) -> str:
    """``value`` with an SI prefix before ``unit`` and ``digits`` significant digits; without a prefix where none is
    small or large enough (_SHOWN). A dash when it is not known.
    """
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return f"{value} {unit}".strip()
    if value == 0:
        return f"0 {unit}".strip()
    factor, prefix = next((pair for pair in _PREFIXES if abs(value) >= 0.9995 * pair[0]), (1e-12, "p"))
    scaled = value / factor
    if not _SHOWN[0] <= abs(scaled) < _SHOWN[1]:
        return f"{value:.{digits}g} {unit}".strip()
    before = max(1, math.floor(math.log10(abs(scaled)) + 1e-3) + 1)
    return f"{scaled:.{max(0, digits - before)}f} {prefix}{unit}".strip()


def count(value: float | None) -> str:
    """A whole number with spaces between thousands: ``12 400``, from 10^12 on ``2.4e+21``; a dash when not known."""
    if value is None:
        return "–"
    if abs(value) >= _MOST:
        return f"{value:.3g}"
    return f"{round(value):,}".replace(",", " ")


def duration(seconds: float) -> str:
    """Wall time: ``0.4 s``, ``42 s``, ``2 min 05 s``, ``3 h 04 min``; a dash when it is not known."""
    if not math.isfinite(seconds) or seconds < 0:
        return "–"
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    if whole < 3600 * _MOST_HOURS:
        return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
    return f"{seconds / 3600:.3g} h"


def clock(wall: float) -> str:
    """The time of day of a Unix time, in the local zone: ``14:03:27``."""
    return datetime.fromtimestamp(wall).strftime("%H:%M:%S")


def day(wall: float) -> str:
    """Date and time of a Unix time, in the local zone: ``21 Nov 14:03``, of another year ``2025-11-21``."""
    then = datetime.fromtimestamp(wall)
    return then.strftime("%d %b %H:%M" if then.year == datetime.now().year else "%Y-%m-%d")


def number(value: float) -> str:
    """Six significant digits, for tables; a dash when it is not known."""
    return known(value, ".6g")


def rough(value: float) -> str:
    """Two significant digits and the power of ten, for residuals; a dash when it is not known."""
    return known(value, ".1e")


def known(value: float, form: str) -> str:
    """The number in this form; a dash when it is not known."""
    return "–" if math.isnan(value) else format(value, form)
