"""Arithmetic expressions of LS-DYNA keyword decks (LS-DYNA Keyword User's Manual I, *PARAMETER_EXPRESSION).

An expression has whole numbers and real numbers, names of parameters with or without ``&``, ``+ - * / **``, brackets
and the functions of the manual. The rules are those of the manual: a sign belongs to its number before ``**`` is
computed, so ``-3**2`` is 9; whole numbers give whole numbers, so ``2/5`` is 0; ``mod`` rounds its arguments. Angles are
in radians.
"""

import math
import re
from collections.abc import Callable, Mapping

from .problems import shown

Number = int | float

_TOKEN = re.compile(
    r"\s*(?:((?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eEdD][+-]?[0-9]+)?)|&?([A-Za-z_]\w*)|(\*\*|[-+*/(),]))", re.ASCII
)
_LONGEST, _DEEPEST, _LARGEST = 2000, 40, 10**18
"""Largest number of characters, of nested brackets, and largest whole number. Chosen values: an expression of a deck
has some lines, and a whole number of a deck has at most 18 digits."""


def _rounded(value: Number) -> int:
    """Returns the next whole number; halves are rounded away from 0, as in Fortran."""
    return int(math.copysign(math.floor(abs(value) + 0.5), value))


def _signed(one: Number, other: Number) -> Number:
    return abs(one) if other >= 0 else -abs(one)


def _mod(one: Number, other: Number) -> int:
    return int(math.fmod(_rounded(one), _rounded(other)))


_REAL = ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh",
         "sqrt", "exp", "log", "log10")  # fmt: skip
_FUNCTIONS: Mapping[str, tuple[int, Callable[..., Number]]] = {
    **{name: (1 + (name == "atan2"), getattr(math, name)) for name in _REAL},
    "csc": (1, lambda x: 1.0 / math.sin(x)), "sec": (1, lambda x: 1.0 / math.cos(x)),
    "ctn": (1, lambda x: 1.0 / math.tan(x)), "abs": (1, abs), "float": (1, float), "int": (1, math.trunc),
    "aint": (1, lambda x: float(math.trunc(x))), "nint": (1, _rounded), "anint": (1, lambda x: float(_rounded(x))),
    "sign": (2, _signed), "mod": (2, _mod), "min": (2, min), "max": (2, max),
}  # fmt: skip
"""Number of arguments and function by name."""
_CONSTANTS = {"pi": math.pi, "dtor": math.pi / 180.0, "rtod": 180.0 / math.pi}
"""Names that the manual reserves for constants (its appendix on functions)."""


def evaluate(text: str, parameters: Mapping[str, Number | str]) -> Number:
    """Returns the value of an expression; the type of the value is that of the expression.

    ``parameters``: values by name in lower case; a text is the value of a parameter of characters. Raises ValueError
    with the reason if the text is no expression, or if its value is not finite.
    """
    if len(text) > _LONGEST:
        raise ValueError(f"the expression has more than {_LONGEST} characters")
    try:
        return _Expression(text, parameters).value()
    except OverflowError:
        raise ValueError("a value is too large") from None
    except ZeroDivisionError:
        raise ValueError("a division by 0") from None


class _Expression:
    """An expression that is read from left to right."""

    def __init__(self, text: str, parameters: Mapping[str, Number | str]) -> None:
        self._text, self._parameters = text.strip(), parameters
        self._at = self._depth = 0

    def value(self) -> Number:
        found = self._sum()
        if self._at < len(self._text):
            raise ValueError(f"{shown(self._text[self._at :].strip())} is behind the end of the expression")
        return found

    def _next(self, *wanted: str) -> str:
        """Returns the next sign and moves behind it, if it is one of ``wanted``; an empty text otherwise."""
        found = _TOKEN.match(self._text, self._at)
        if found is None or found[3] not in wanted:
            return ""
        self._at = found.end()
        return found[3]

    def _sum(self) -> Number:
        found = self._product()
        while sign := self._next("+", "-"):
            other = self._product()
            found = _sized(found + other if sign == "+" else found - other)
        return found

    def _product(self) -> Number:
        found = self._power()
        while sign := self._next("*", "/"):
            other = self._power()
            found = _sized(found * other) if sign == "*" else _quotient(found, other)
        return found

    def _power(self) -> Number:
        """Reads powers, of which the last is computed first, as in Fortran."""
        bases = [self._factor()]
        while self._next("**"):
            bases.append(self._factor())
        found = bases.pop()
        while bases:
            found = _raised(bases.pop(), found)
        return found

    def _factor(self) -> Number:
        """Reads a number with its signs."""
        negative = False
        while sign := self._next("+", "-"):
            negative ^= sign == "-"
        found = self._plain()
        return -found if negative else found

    def _plain(self) -> Number:
        if self._next("("):
            return self._bracket()[0]
        found = _TOKEN.match(self._text, self._at)
        if found is None or found[3]:
            rest = self._text[self._at :].strip()
            raise ValueError(f"a number or a name is expected {f'at {shown(rest)}' if rest else 'at the end'}")
        self._at = found.end()
        if found[1]:
            return _read(found[1])
        name = found[2].lower()
        return self._called(name) if self._next("(") else self._named(name)

    def _bracket(self) -> list[Number]:
        """Reads values between commas up to the closing bracket."""
        self._depth += 1
        if self._depth > _DEEPEST:
            raise ValueError(f"more than {_DEEPEST} brackets within each other")
        found = [self._sum()]
        while self._next(","):
            found.append(self._sum())
        if not self._next(")"):
            raise ValueError("a bracket is not closed")
        self._depth -= 1
        return found

    def _called(self, name: str) -> Number:
        if name not in _FUNCTIONS:
            raise ValueError(f"{shown(name)} is no function; known: {', '.join(_FUNCTIONS)}")
        count, function = _FUNCTIONS[name]
        values = self._bracket()
        if len(values) != count and not (name in ("min", "max") and len(values) > 2):
            raise ValueError(f"{name} has {len(values)} arguments instead of {count}")
        whole = all(isinstance(value, int) for value in values)
        try:
            found = function(*values)
        except ValueError:
            raise ValueError(f"{name} has no value at {', '.join(map(str, values))}") from None
        return float(found) if name in ("min", "max") and not whole else _sized(found)

    def _named(self, name: str) -> Number:
        found = self._parameters.get(name, _CONSTANTS.get(name))
        if found is None:
            known = ", ".join(self._parameters) or "none"
            raise ValueError(f"the parameter {shown(name)} is not defined above; known: {known}")
        if isinstance(found, str):
            raise ValueError(f"the parameter {shown(name)} has the text {shown(found)}, which is no number")
        return found


def _read(text: str) -> Number:
    return _sized(int(text) if text.isdigit() else float(text.lower().replace("d", "e")))


def _sized(value: Number) -> Number:
    """Returns a value. Raises OverflowError if the value is not finite, or is a whole number with too many digits."""
    if not math.isfinite(value) or (isinstance(value, int) and abs(value) >= _LARGEST):
        raise OverflowError
    return value


def _quotient(one: Number, other: Number) -> Number:
    """Returns a quotient; the quotient of whole numbers is a whole number, rounded towards 0."""
    if isinstance(one, int) and isinstance(other, int):
        found = abs(one) // abs(other)
        return found if (one < 0) == (other < 0) else -found
    return _sized(one / other)


def _raised(base: Number, power: Number) -> Number:
    """Returns a power. Raises ValueError for a whole number with a negative exponent, for which the manual has no rule,
    and for a root of a negative number.
    """
    if isinstance(base, int) and isinstance(power, int):
        if power < 0:
            raise ValueError(f"{base}**{power}: write {float(base)}**{power} for a real value")
        if abs(base) > 1 and power * math.log2(abs(base)) > 64:
            raise OverflowError
        return _sized(base**power)
    found = base**power
    if isinstance(found, complex):
        raise ValueError(f"{base}**{power} has no value")
    return _sized(found)
