"""Names for a case, made from names of a deck that a case does not allow: titles with blanks, numbers, repeated
titles.
"""

import re
import unicodedata

_MOST = 64
"""Largest number of characters of a name in a case (cases/model/tables.py)."""


class Names:
    """Unique names that a case allows."""

    def __init__(self) -> None:
        """Starts without names."""
        self._taken: set[str] = set()

    def give(self, wanted: str, kind: str, number: object = "") -> str:
        """Returns a valid name similar to ``wanted``. If no character of ``wanted`` is valid, the name consists of
        ``kind`` and ``number``.
        """
        plain = wanted if name(wanted)[:1] == wanted.strip()[:1] else f"{kind}_{wanted or number}"
        base = name(plain) or kind
        found, count = base, 1
        while found.lower() in self._taken:
            count += 1
            end = f"_{number}" if number != "" and count == 2 else f"_{count}"
            found = base[: _MOST - len(name_end(end))] + name_end(end)
        self._taken.add(found.lower())
        return found


def name(text: str) -> str:
    """Returns the letters, digits, ``_`` and ``-`` of a text, from the first letter on; empty if the text has no
    letter.
    """
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    joined = re.sub(r"[^A-Za-z0-9_-]+", "_", plain).strip("_")
    return re.sub(r"^[^A-Za-z]+", "", joined)[:_MOST].rstrip("_")


def name_end(text: str) -> str:
    """Returns the suffix that distinguishes a name from an equal name."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", text)
