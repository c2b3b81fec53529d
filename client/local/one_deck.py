"""Joins a deck and all files that it includes into one file, which is then hashed and sent."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from conoid.cases.reading import inp, whole
from conoid.cases.reading.included import LONGEST_LINE, Included, flattened, included_by, lines

ENDINGS = (".k", ".key", ".dyn")
"""Endings of the names of keyword decks."""
_PLAIN: dict[str, Callable[[str], str | None]] = {".inp": inp.included_by, ".rad": included_by}
"""Endings of the names of other decks, each with a function that recognises a line that includes a file. The lines
of the included file replace this line."""
_INCLUDES = re.compile(rb"(?i)\n(?:\xef\xbb\xbf)?[ \t]*[*#][ \t]*INCLUDE")
_CHUNK, _LINE = 1 << 20, 200
"""Number of bytes that are searched at a time, and number of bytes of an incomplete line that are searched again with
the next bytes (chosen values: a search needs a few MB of memory for a file of any size)."""
_STANDARD = "*KEYWORD"


def includes(path: Path) -> bool:
    """Returns True if a file is a deck that may include other files. Raises OSError."""
    if path.suffix.lower() not in (*ENDINGS, *_PLAIN):
        return False
    rest = b"\n"
    with whole.opened(path) as file:
        while data := file.read(_CHUNK):
            text = rest + data
            if _INCLUDES.search(text):
                return True
            rest = text[text.rfind(b"\n") :][:_LINE]
    return False


def write(deck: Path, target: Path) -> list[Path]:
    """Writes a deck with all its includes to ``target``; returns the paths of all source files. Raises ValueError
    for unusable includes, OSError.
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
    """Yields the lines of a deck; the lines of an included file replace the line that includes it.

    The format of a ``*KEYWORD`` line holds in its own file and in the files that are included after it. If a file
    has changed the format, the earlier format line is written again after this file.
    """

    included: Included
    stands: str = _STANDARD
    """The text line that set the format of the last written line."""

    def of(self, path: Path, stands: str, *, top: bool = False) -> Iterator[str]:
        """Yields the lines of a file whose format at the beginning is ``stands``."""
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
        """Yields the lines of included files. A file name that ends with `` +`` continues in the next text line."""
        for name in "\n".join(names).replace(" +\n", "").splitlines():
            yield f"$ begin of {name}"
            yield from self.of(self.included.enter(name, path), stands)
            self.included.leave()
            yield f"$ end of {name}"
            if self.stands != stands:
                self.stands = stands
                yield stands


def _name(text: str) -> str:
    """Returns the keyword of a line in upper case, with its suffix; "?" for a line without a keyword."""
    word = text[1:].partition("$")[0].split()
    return word[0].upper() if word[:1] and (len(word) == 1 or word[0].upper() == "KEYWORD") else "?"
