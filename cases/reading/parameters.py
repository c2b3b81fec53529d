"""Parameters of LS-DYNA keyword decks: their definitions, and their use in fields of cards."""

import re
from collections.abc import Iterator, Mapping, Sequence

from .expressions import Number, evaluate
from .problems import shown

Values = Mapping[str, Number | str]
"""Values of parameters by their names in lower case. A parameter of the type I has an int, of the type R a float, of
the type C a text."""

OPTIONS = frozenset({"EXPRESSION", "LOCAL", "GLOBAL", "MUTABLE", "TYPE", "DUPLICATION", "NOECHO"})
"""Words behind ``*PARAMETER`` that are read. A second definition with another value is refused in every file, so the
words that choose one of two definitions (LOCAL, MUTABLE, DUPLICATION) need no rule."""
_NAME = re.compile(r"([IiRrCc])\s*([A-Za-z_][A-Za-z0-9_]*)", re.ASCII)
_COMMA = re.compile(r"\s*([IiRrCc]\s*[A-Za-z_][A-Za-z0-9_]*)\s*,(.*)", re.ASCII)
_USE = re.compile(r"([+-]?)&\s*([A-Za-z_][A-Za-z0-9_]*)", re.ASCII)
_REAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eEdD][+-]?[0-9]{1,4}|[+-][0-9]{1,4})?", re.ASCII)
_NAME_WIDTH = 10
"""Number of columns of the name before an expression (the manual, *PARAMETER_EXPRESSION)."""


def pairs(items: Sequence[str], options: frozenset[str]) -> Iterator[tuple[str, str]]:
    """Yields names with types and values of the fields of one card of ``*PARAMETER``. A card of ``*PARAMETER_TYPE`` has
    one name, and behind the value a remark for pre-processors.
    """
    items = items[:2] if "TYPE" in options else items
    for name, value in zip(items[::2], items[1::2], strict=False):
        if name or value:
            yield name, value


def expressions(lines: Sequence[str], width: int) -> Iterator[tuple[int, str, str]]:
    """Yields names with types and expressions of ``*PARAMETER_EXPRESSION``, each with the index of its first line. A
    line whose first ``width`` columns are empty continues the expression of the line before.
    """
    width, found = max(width, _NAME_WIDTH), list[tuple[int, str, str]]()
    for index, line in enumerate(lines):
        if found and line.strip() and not line[:width].strip():
            first, name, text = found.pop()
            found.append((first, name, text + line[width:]))
        elif line.strip():
            comma = _COMMA.match(line)
            name, text = (comma[1], comma[2]) if comma else (line[:width], line[width:])
            found.append((index, name, text))
    yield from ((index, name.strip(), text.strip()) for index, name, text in found)


def defined(known: Values, name: str, text: str, *, computed: bool) -> Values:
    """Returns the parameters with a further one. ``name``: type and name, such as ``R speed``; ``text``: value, or
    expression if ``computed``. Raises ValueError for an impossible definition, or for a second value.
    """
    found = _NAME.fullmatch(name)
    if found is None or not text:
        raise ValueError(f"{shown(name)} with the value {shown(text)} defines no parameter")
    kind, key = found[1].upper(), found[2].lower()
    value = text if kind == "C" else _number(kind, evaluate(text, known) if computed else _plain(key, text), key)
    if known.get(key, value) != value:
        raise ValueError(f"the parameter {shown(key)} has another value above")
    return {**known, key: value}


def _plain(key: str, text: str) -> Number:
    """Reads the value of a parameter, also in the form ``1.5-3``."""
    if not _REAL.fullmatch(text):
        raise ValueError(f"the parameter {shown(key)} = {shown(text)} is not a number")
    if text.lstrip("+-").isdigit():
        return int(text)
    return float(re.sub(r"(?<=[0-9.])([+-])", r"e\1", re.sub("[dD]", "e", text)) if "e" not in text.lower() else text)


def _number(kind: str, value: Number, key: str) -> Number:
    if kind == "R":
        return float(value)
    if value != int(value):
        raise ValueError(f"the parameter {shown(key)} = {value:g} of the type I is not a whole number; use int or nint")
    return int(value)


def valued(item: str, known: Values) -> str:
    """Returns a field with the values of its parameters: of ``&name``, of ``-&name``, of an expression with ``&``, and
    of an expression between ``<`` and ``>``. Raises ValueError.
    """
    used = _USE.fullmatch(item)
    if used is None:
        bare = item[1:-1] if item.startswith("<") and item.endswith(">") else item
        try:
            return repr(evaluate(bare, known))
        except ValueError as error:
            raise ValueError(f"{shown(item)}: {error}") from None
    value = known.get(used[2].lower())
    if value is None:
        names = ", ".join(known) or "none"
        raise ValueError(f"the parameter {shown(item)} is not defined above; known: {names}")
    if used[1] == "-":
        if isinstance(value, str):
            raise ValueError(f"the parameter {shown(item)} has the text {shown(value)}, which is no number")
        value = -value
    return value if isinstance(value, str) else repr(value)
