"""The files of a deck (input file): the deck itself and the files that it includes. All of them must be below the
folder of the deck.
"""

import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Self

from . import whole

_DEEPEST, _MOST = 8, 1000
"""Largest depth of included files, and largest number of files of a deck. Decks of complete vehicles have some hundred
files, three levels deep (reason of the chosen values)."""
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
LONGEST = 4096
"""Largest number of characters of a line with cards. The longest card format has 200 characters (reason of the chosen
value)."""
LONGEST_LINE = 65_536
"""Largest number of characters of a line of values between commas (chosen value). Abaqus allows 256 characters, but
programs that write a set in one line write some thousand characters."""


class Included:
    """The files of a deck that have been read, and the files that are being read at present (a file that includes
    another one stays open).
    """

    def __init__(self, path: Path) -> None:
        """Creates the object; ``path``: path of the deck."""
        self.files: list[Path] = []
        """Every file that has been opened, once, in the order of opening."""
        self.followed: list[Line] = []
        """The lines that include the files that are being read; the deck itself has none."""
        self._path = path
        self._open: list[Path] = []
        self._count = 0

    def start(self) -> Path:
        """Opens the deck itself and returns its path."""
        self._open = [self._path.resolve()]
        self.files = [self._open[0]]
        return self._path

    def enter(self, name: str, including: Path) -> Path:
        """Opens the file ``name`` and returns its path. The name is relative to the folder of the deck; if there is no
        such file, relative to the folder of the file ``including``. Raises ValueError if the file does not exist, is
        not below the folder of the deck, or includes itself.
        """
        folder = self._path.resolve().parent
        places = [(start / name.replace("\\", "/")) for start in (folder, including.resolve().parent)]
        inside = list(dict.fromkeys(place.resolve() for place in places if "\0" not in name))
        there = [place for place in inside if place.is_relative_to(folder) and place.is_file()]
        if not there:
            away = not any(place.is_relative_to(folder) for place in inside)
            why = "is not below the folder of the deck" if away else "is no file there"
            raise ValueError(f"the included file {name[:80]!r} {why}")
        if len(there) > 1:
            raise ValueError(f"the included file {name[:80]!r} is in the folder of the deck and in that of this file")
        if there[0] in self._open:
            raise ValueError(f"the file {name[:80]!r} includes itself")
        self._open.append(there[0])
        self._count += 1
        if len(self._open) > _DEEPEST or self._count > _MOST:
            raise ValueError(f"more than {_MOST} files are included, or more than {_DEEPEST} within each other")
        if there[0] not in self.files:
            self.files.append(there[0])
        return there[0]

    def follow(self, name: str, including: Path, line: "Line") -> Path:
        """Opens the file ``name``, which ``line`` of the file ``including`` includes; see ``enter``. Raises ValueError
        with the number of the line if the file cannot be opened.
        """
        self.followed.append(line)
        try:
            return self.enter(name, including)
        except ValueError as error:
            raise ValueError(f"line {line}: {error}") from None

    def leave(self) -> None:
        """Closes the file that was opened last."""
        self._open.pop()


class Line(int):
    """Number of a line in its file. The text of the line number is ``7``, or ``7 of mesh.inc`` for an included file."""

    file: str

    def __new__(cls, number: int, file: str = "") -> Self:
        """Creates the number; ``file``: name of the included file, empty for the deck itself."""
        made = super().__new__(cls, number)
        made.file = file
        return made

    def __str__(self) -> str:
        """Returns the number of the line as text, with the name of the file if it is an included file."""
        return f"{int(self)} of {self.file}" if self.file else f"{int(self)}"


def own(line: int) -> int:
    """Returns the number of a line of the deck itself, and 0 for a line of an included file."""
    return 0 if getattr(line, "file", "") else int(line)


def flattened(deck: Included, named: Callable[[str], str | None], longest: int = LONGEST) -> Iterator[tuple[Line, str]]:
    """Yields the lines of a deck with their numbers. A line that includes a file is replaced by the lines of this file.

    ``named``: function that returns the name of the file that a line includes, or None for any other line. ``longest``:
    largest number of characters of a line. Raises ValueError if a file is not valid text or cannot be included; raises
    OSError if the deck cannot be opened.
    """
    return _flat(deck, deck.start(), "", named, longest)


def included_by(text: str) -> str | None:
    """Returns the file that a line ``#include mesh.inc`` of a Radioss deck names; None for any other line."""
    word, _, name = text.strip().partition(" ")
    return name.strip().strip('"') if word.lower() == "#include" and name.strip() else None


def _flat(
    deck: Included, path: Path, file: str, named: Callable[[str], str | None], longest: int
) -> Iterator[tuple[Line, str]]:
    for number, text in lines(path, longest):
        if (name := named(text)) is None:
            yield Line(number, file), text
            continue
        yield from _flat(deck, deck.follow(name, path, Line(number, file)), name, named, longest)
        deck.leave()


def lines(path: Path, longest: int = LONGEST) -> Iterator[tuple[int, str]]:
    """Yields the lines of a text file with their numbers, without line ends. Bytes that are not valid UTF-8 are read as
    Latin-1. Raises ValueError if the file is not text, and OSError if it is not a regular file.
    """
    with whole.opened(path) as raw, io.BufferedReader(raw) as data:
        if data.peek(2)[:2] in _UTF_16:
            raise ValueError("the file is UTF-16; save it as UTF-8 text")
        number = 0
        while line := data.readline(longest):
            number += 1
            if len(line) == longest:
                raise ValueError(f"line {number}: a line of more than {longest} characters; this is no text file")
            if b"\0" in line:
                raise ValueError(f"line {number}: a null byte; this is no text file")
            yield number, _decoded(line.rstrip(b"\r\n").removeprefix(b"\xef\xbb\xbf" if number == 1 else b""))


def _decoded(line: bytes) -> str:
    try:
        return line.decode()
    except UnicodeDecodeError:
        return line.decode("latin-1")
