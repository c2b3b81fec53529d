"""Names that are similar to a misspelt name, for the ends of messages."""

import difflib
from collections.abc import Iterable

_LONGEST = 80
"""Number of characters of a name that are compared; no allowed name is longer (reason of the chosen value)."""
_CUTOFF, _MOST = 0.6, 3
"""Smallest similarity of a name that is suggested (the default of difflib), and largest number of suggestions (chosen
value)."""
_PART = 3
"""Smallest number of letters of a misspelt name for which names that begin with it are suggested; too many names begin
with fewer letters (reason of the chosen value)."""


def close(word: str, known: Iterable[str]) -> list[str]:
    """Returns the allowed names that a misspelt name may mean, the most similar first; capitals, blanks, ``-`` and
    ``_`` make no difference.
    """
    names: dict[str, str] = {}
    for name in known:
        names.setdefault(_plain(name), name)
    plain = _plain(word[:_LONGEST])
    found = difflib.get_close_matches(plain, names, n=_MOST, cutoff=_CUTOFF)
    begun = [name for name in names if len(plain) >= _PART and name.startswith(plain)]
    return [names[name] for name in (found or begun[:_MOST])]


def meant(word: object, known: Iterable[str]) -> str:
    """Returns the text ``; did you mean 'mises'?`` for the end of a message that lists the allowed names. The text is
    empty if no name is similar.
    """
    found = close(word, known) if isinstance(word, str) else []
    return f"; {_asked(found)}" if found else ""


def allowed(word: object, known: Iterable[str]) -> str:
    """Returns ``allowed: mises, pressure; did you mean 'mises'?`` for the end of a message."""
    names = list(known)
    return f"allowed: {', '.join(names) or 'none'}{meant(word, names)}"


def nearest(word: str, known: Iterable[str]) -> str:
    """Returns ``did you mean 'radius'?``, or the list of allowed names, for the end of a message."""
    names = list(dict.fromkeys(known))
    found = close(word, names)
    return _asked(found) if found else f"known: {choices(names)}"


def choices(names: Iterable[str]) -> str:
    """Returns the allowed words as ``'a', 'b'``, in the given order."""
    return ", ".join(repr(name) for name in names) or "none"


def _asked(found: list[str]) -> str:
    return f"did you mean {' or '.join(map(repr, found))}?"


def _plain(name: str) -> str:
    return name.casefold().replace("-", "_").replace(" ", "_")
