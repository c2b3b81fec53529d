"""A deck with all that it includes, as one file: so it is sent, hashed and kept."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from conoid.cases.reading import inp, whole
from conoid.cases.reading.included import LONGEST_LINE, Included, flattened, included_by, lines

ENDINGS = (".k", ".key", ".dyn")
"""Of the names of keyword decks."""
_PLAIN: dict[str, Callable[[str], str | None]] = {".inp": inp.included_by, ".rad": included_by}
"""Endings of the other decks, and which file a line of them includes: its lines stand in the place of that line."""
_INCLUDES = re.compile(rb"(?im)^[ \t]*[*#][ \t]*INCLUDE")
_CHUNK = 1 << 24
"""Bytes that are searched at once. Chosen."""
_STANDARD = "*KEYWORD"


def includes(path: Path) -> bool:
    """Whether a file is a deck that may include others. Raises OSError."""
    if path.suffix.lower() not in (*ENDINGS, *_PLAIN):
        return False
    rest = b""
    with whole.opened(path) as file:
        while data := file.read(_CHUNK):
            if _INCLUDES.search(rest + data):
                return True
            rest = data[data.rfind(b"\n") + 1 :][:200]
    return False


def write(deck: Path, target: Path) -> list[Path]:
    """Writes the deck with all that it includes to ``target``; returns every file that it was read from.

    Raises ValueError where it cannot be followed, OSError.
    """
    included, plain = Included(deck), _PLAIN.get(deck.suffix.lower())
    with target.open("w", encoding="utf-8", newline="\n") as made:
        if plain is not None:
            made.writelines(f"{text}\n" for _, text in flattened(included, plain, LONGEST_LINE))
        else:
            made.writelines(f"{text}\n" for text in _Flat(included).of(included.start(), _STANDARD, top=True))
    return included.files


@dataclass
class _Flat:
    """The lines of a deck, those of what it includes in their places. The format that ``*KEYWORD`` sets holds in its
    own file and in what that includes from there on: it is set again behind a file that has set another one.
    """

    included: Included
    stands: str = _STANDARD
    """The line that has set the format of what was written last."""

    def of(self, path: Path, stands: str, *, top: bool = False) -> Iterator[str]:
        """The lines of a file that begins in the format that ``stands``."""
        names: list[str] | None = None
        for _, text in lines(path):
            name = _name(text) if text.startswith("*") else ""
            if name and names is not None:
                yield from self._follow(names, path, stands)
                names = None
            if name == "INCLUDE":
                names = []
            elif name == "END":
                break
            elif names is not None:
                names += [text.strip()] if text.strip() and not text.startswith("$") else []
            else:
                stands = self.stands = text if name == "KEYWORD" else stands
                yield text
        if names is not None:
            yield from self._follow(names, path, stands)
        if top:
            yield "*END"

    def _follow(self, names: list[str], path: Path, stands: str) -> Iterator[str]:
        """The lines of included files; a name that ends with `` +`` goes on in the next line."""
        for name in "\n".join(names).replace(" +\n", "").splitlines():
            yield f"$ begin of {name}"
            yield from self.of(self.included.enter(name, path), stands)
            self.included.leave()
            yield f"$ end of {name}"
            if self.stands != stands:
                self.stands = stands
                yield stands


def _name(text: str) -> str:
    """Of a keyword line, in upper case; with its suffix, where it has one."""
    word = text[1:].partition("$")[0].split()
    return word[0].upper() if word[:1] and (len(word) == 1 or word[0].upper() == "KEYWORD") else "?"
