"""Names of a case for what a deck calls otherwise: titles with blanks, numbers, one title twice."""

import re
import unicodedata

_MOST = 64
"""Characters of a name of a case (cases/model/tables.py)."""


class Names:
    """Gives names that a case may have, each once."""

    def __init__(self) -> None:
        """None is taken yet."""
        self._taken: set[str] = set()

    def give(self, wanted: str, kind: str, number: object = "") -> str:
        """A name as near to ``wanted`` as can be; ``kind`` and ``number`` where nothing of it is left."""
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
    """Letters, digits, ``_`` and ``-`` of a text, from its first letter on; empty where there is none."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    joined = re.sub(r"[^A-Za-z0-9_-]+", "_", plain).strip("_")
    return re.sub(r"^[^A-Za-z]+", "", joined)[:_MOST].rstrip("_")


def name_end(text: str) -> str:
    """What is put behind a name to tell it from another one."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", text)
