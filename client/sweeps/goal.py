"""Goal of an adaptive sweep, read from text: a result with its threshold, and the spans of the keys that vary."""

import math
from collections.abc import Sequence
from typing import Any

import msgspec

from conoid.cases.load import CaseError, Problem
from conoid.cases.model.schema import Case
from conoid.cases.output import points
from conoid.cases.reading.problems import shown
from conoid.cases.reading.similar import nearest
from conoid.cases.units import parse_quantity, written

_ADAPTIVE, _SET, _TOLERANCE = "--adaptive", "--set", "--tolerance"
_SHARE = 0.01
"""Default tolerance, relative to the larger end of the span (chosen value: smaller than the scatter of ballistic
tests)."""
_DIGITS = 9
"""Number of digits of a value at which a run is made (chosen value: no case is sensitive to further digits)."""


class Goal(msgspec.Struct, kw_only=True, frozen=True):
    """A result and the threshold that the result shall cross; both are in ``unit``."""

    result: str
    threshold: float
    unit: str = ""


class Span(msgspec.Struct, kw_only=True, frozen=True):
    """A key and its values at both ends of the range, in ``unit``; ``unit`` is empty for plain numbers."""

    key: str
    low: float
    high: float
    unit: str = ""

    def value(self, x: float) -> str | float:
        """Returns a value of the span in the form in which it is written into the case."""
        rounded = float(f"{x:.{_DIGITS}g}")
        return f"{rounded!r} {self.unit}" if self.unit else rounded

    def along(self, other: "Span", x: float) -> str | float:
        """Returns the value of this key that corresponds to ``x`` of the span ``other``, by linear interpolation."""
        return self.value(self.low + (self.high - self.low) * (x - other.low) / (other.high - other.low))


def goal_of(words: str, case: Case) -> Goal:
    """Reads a text such as ``probe.NAME = 0``: the name of a result without its unit, and a threshold. Raises
    CaseError.
    """
    name, equals, text = (part.strip() for part in words.rpartition("="))
    known = points.names(case)
    if not equals or not name or not text:
        raise _wrong(_ADAPTIVE, words, "write a result and its threshold, such as 'probe.NAME = 0'")
    if name not in known:
        raise _wrong(_ADAPTIVE, name, f"unknown result; {nearest(name, known)}")
    return Goal(result=name, threshold=_number(_ADAPTIVE, text, known[name]), unit=known[name])


def spans_of(words: Sequence[str]) -> tuple[list[Span], dict[str, Any]]:
    """Returns the spans of texts such as ``KEY=LOW:HIGH``, and the values of texts such as ``KEY=VALUE``. Raises
    CaseError.
    """
    from .sweep import axes_of

    spans, constants = list[Span](), dict[str, Any]()
    for key, values in axes_of(words).items():
        if len(values) > 1:
            message = f"{key} has {len(values)} values; allowed in an adaptive sweep: KEY=LOW:HIGH, or one value"
            raise _wrong(_SET, ",".join(map(str, values)), message)
        text = values[0]
        if isinstance(text, str) and ":" in text and (span := _span(key, text)) is not None:
            spans.append(span)
        else:
            constants[key] = text
    if not spans:
        raise _wrong(
            _SET, " ".join(words), "give a key that varies as KEY=LOW:HIGH, such as parts[0].velocity[2]=-200:-800 m/s"
        )
    return spans, constants


def span_of(key: str, ends: Any) -> Span:
    """Returns the span between two values of a key. Raises CaseError."""
    if not isinstance(ends, Sequence) or isinstance(ends, str) or len(ends) != 2:
        raise _wrong("spans", ends, f"{key} needs two values, such as ('-200 m/s', '-800 m/s')")
    unit, (low, high) = points.in_one_unit(key, list(ends))
    if not isinstance(low, int | float) or not isinstance(high, int | float):
        raise _wrong(
            "spans", ends, f"{key}: allowed: two numbers of the same dimension, such as ('-200 m/s', '-800 m/s')"
        )
    if low == high:
        raise _wrong("spans", ends, f"{key}: both ends of the range are equal")
    return Span(key=key, low=float(low), high=float(high), unit=unit)


def _span(key: str, text: str) -> Span | None:
    """Returns the span of the text ``LOW:HIGH``; None for another text. A unit after HIGH also applies to LOW."""
    low, _, high = (part.strip() for part in text.partition(":"))
    first, second = written(low), written(high)
    if first is None or second is None:
        return None
    return span_of(key, [low if first[1] else f"{low} {second[1]}".strip(), high])


def tolerance_of(given: Any, span: Span) -> float:
    """Returns the tolerance in the unit of the span. A number without a unit has the unit of the span. Raises
    CaseError.
    """
    if given is None:
        return _SHARE * max(abs(span.low), abs(span.high))
    pair = written(given)
    if pair is not None and not pair[1]:
        found = float(pair[0])
    else:
        found = _number(_TOLERANCE, str(given), span.unit) / parse_quantity(f"1 {span.unit}".strip(), span.unit)
    if not 0.0 < found < math.inf:
        raise _wrong(_TOLERANCE, given, "above 0")
    return found


def _number(option: str, text: str, unit: str) -> float:
    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        raise _wrong(option, text, str(error)) from None


def _wrong(option: str, value: Any, message: str) -> CaseError:
    return CaseError([Problem(option, shown(value), message)])


def changes(spans: Sequence[Span], x: float) -> dict[str, Any]:
    """Returns the values of the changed keys at a point. ``x`` is the value of the first span; the other keys are
    interpolated at the same relative position.
    """
    return {span.key: span.along(spans[0], x) for span in spans}
