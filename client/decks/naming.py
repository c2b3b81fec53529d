"""Names of a case for names in a deck that a case cannot have: titles with blanks, numbers, repeated titles."""

import re
import unicodedata

_MOST = 64
"""Largest number of characters of a name of a case (cases/model/tables.py)."""


class Names:
    """Unique names that are valid in a case."""

    def __init__(self) -> None:
        """Starts without names."""
        self._taken: set[str] = set()

    def give(self, wanted: str, kind: str, number: object = "") -> str:
        """Returns a name close to ``wanted``; ``kind`` and ``number`` where none of its characters is valid."""
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
    """Returns letters, digits, ``_`` and ``-`` of a text, from its first letter on; empty if there is none."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    joined = re.sub(r"[^A-Za-z0-9_-]+", "_", plain).strip("_")
    return re.sub(r"^[^A-Za-z]+", "", joined)[:_MOST].rstrip("_")


def name_end(text: str) -> str:
    """Returns the suffix that distinguishes a name from another."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", text)
