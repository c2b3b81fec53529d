"""The text of an Abaqus input file: keyword lines with their parameters, and data lines.

The rules are those of the Analysis User's Guide, "Input syntax rules": a line that begins with ``*`` is a keyword line,
a line that begins with ``**`` is a comment. Outside of quotation marks, capitals and blanks have no meaning. A keyword
line that ends with a comma continues in the next line. The exponent of a number may begin with D. An empty field means
0.
"""

import math
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from .included import LONGEST_LINE, Included, Line
from .problems import ConoidError

_FIELD = re.compile(r'(?:"[^"]*"|[^",])*')
_NUMBERS = re.compile(r"[0-9+\-.eEdD,\s]*", re.ASCII)
_WHOLE = re.compile(r"\s*\+?[0-9]{1,18}\s*", re.ASCII)
_WHOLES = re.compile(r"[0-9,\s]*", re.ASCII)
_INCLUDE = re.compile(r"\s*\*\s*INCLUDE\s*,", re.ASCII | re.IGNORECASE)
_D = str.maketrans("dD", "ee")
_LONGEST = 60
"""Largest number of characters of a line that an error message shows: half a line of a terminal (chosen value)."""
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_UTF_8 = b"\xef\xbb\xbf"


class InpError(ConoidError, ValueError):
    """Error in an Abaqus input file. The text of the error is one line, with the number of the line in the file."""


@dataclass(frozen=True)
class Block:
    """A keyword line: its keyword, its parameters and its line number. The keyword is in upper case without blanks or
    hyphens; the parameters are pairs (word, value or None).
    """

    word: str
    parameters: list[tuple[str, str | None]]
    line: int


class Source:
    """The lines of an Abaqus input file, read once from the beginning: each keyword line, then its data lines."""

    def __init__(self, path: Path) -> None:
        """Opens the file ``path``. Raises InpError if the file is not text."""
        self.included = Included(path)
        """The files that are read: first ``path``, then the files that it includes (``*INCLUDE, INPUT=``)."""
        self._ahead: tuple[int, str] | None = None

    def blocks(self) -> Iterator[Block]:
        """Yields every keyword line. If the caller has not read the data lines of a keyword, they are skipped. Raises
        InpError if a line is invalid.
        """
        self._lines = self._useful(self.included.start(), "")
        for number, text in self.data():
            if text.strip():
                raise InpError(f"line {number}: data before the first keyword; this is not an .inp file")
        if self._ahead is None:
            raise InpError("the file has no keyword; this is not an .inp file")
        while self._ahead is not None:
            number, text = self._ahead
            self._ahead = None
            yield _block(self._continued(text), number)
            for _ in self.data():
                pass

    def data(self) -> Iterator[tuple[int, str]]:
        """Yields the number and the text of each data line up to the next keyword, including empty lines."""
        if self._ahead is not None:
            return
        for number, text in self._lines:
            if text.lstrip()[:1] == "*":
                self._ahead = number, text
                return
            yield number, text

    def filled(self) -> Iterator[tuple[int, str]]:
        """Yields the data lines that are not empty, with their numbers."""
        return ((number, text) for number, text in self.data() if text.strip())

    def _useful(self, path: Path, name: str) -> Iterator[tuple[int, str]]:
        """Yields the lines that are not comments, with their numbers. A line that includes a file is replaced by the
        lines of this file. ``name``: name of the included file, empty for the deck itself.
        """
        for line, text in _read(path, name):
            if (wanted := included_by(text)) is None:
                yield line, text
                continue
            try:
                inner = self.included.follow(wanted, path, Line(line, name))
            except ValueError as error:
                raise InpError(str(error)) from None
            yield from self._useful(inner, wanted)
            self.included.leave()

    def _continued(self, text: str) -> str:
        """Returns a keyword line joined with its continuation lines."""
        whole = text.strip()
        while whole.endswith(","):
            more = next(self.data(), None)
            if more is None:
                break
            whole += more[1].strip()
        return whole


def _read(path: Path, name: str) -> Iterator[tuple[int, str]]:
    """Yields the lines of one file that are not comments, with their numbers."""
    with path.open("rb") as start:
        if start.read(2) in _UTF_16:
            raise InpError("the file is UTF-16; save it as UTF-8 text")
    with path.open(encoding="latin-1", newline=None) as file:
        for number, text in enumerate(iter(lambda: file.readline(LONGEST_LINE), ""), 1):
            line = Line(number, name) if name else number
            if len(text) == LONGEST_LINE:
                raise InpError(f"line {line}: a line of more than {LONGEST_LINE} characters; this is no text file")
            if number == 1:
                text = text.removeprefix(_UTF_8.decode("latin-1"))
            if not text.isascii():
                text = _decoded(text)
            if "\0" in text:
                raise InpError(f"line {line}: a null byte; this is not a text file")
            if not text.lstrip().startswith("**"):
                yield line, text


def included_by(text: str) -> str | None:
    """Returns the name of the file that a line such as ``*INCLUDE, INPUT=mesh.inc`` includes, and None for any other
    line.
    """
    if not _INCLUDE.match(text):
        return None
    values = [value.strip() for word, _, value in (item.partition("=") for item in fields(text)[1:])
              if "".join(word.split()).upper() == "INPUT"]  # fmt: skip
    return values[0].strip('"') if len(values) == 1 and values[0] else None


def _decoded(text: str) -> str:
    """Decodes bytes as UTF-8 if valid, otherwise as Latin-1."""
    try:
        return text.encode("latin-1").decode("utf-8")
    except UnicodeDecodeError:
        return text


def _block(text: str, line: int) -> Block:
    if text.count('"') % 2:
        raise InpError(f"line {line}: {shortened(text)} has a quotation mark without its partner")
    word, *rest = fields(text[1:])
    pairs = (_parameter(item) for item in rest if item)
    return Block("".join(word.split()).replace("-", "").upper(), list(pairs), line)


def _parameter(item: str) -> tuple[str, str | None]:
    word, equals, value = item.partition("=")
    return "".join(word.split()).upper(), value.strip() if equals else None


def fields(text: str) -> list[str]:
    """Returns the fields of a line, which commas separate, without outer blanks. A comma in quotation marks does not
    separate fields.
    """
    if '"' not in text:
        return [item.strip() for item in text.split(",")]
    found, at = [], 0
    while True:
        item = _FIELD.match(text, at)
        assert item is not None
        found.append(item[0].strip())
        at = item.end() + 1
        if at > len(text):
            return found


def numbers(line: int, text: str) -> list[float]:
    """Returns the numbers of a data line. An empty field is 0; a comma at the end of the line adds no field. Raises
    InpError if a field is not a number.
    """
    if _NUMBERS.fullmatch(text):
        try:
            items = text.translate(_D).split(",")
            if not items[-1].strip():
                items.pop()
            found = [float(item) if item.strip() else 0.0 for item in items]
            if all(map(math.isfinite, found)):
                return found
        except ValueError:
            pass
    raise InpError(f"line {line}: {shortened(text)} is not a list of numbers")


def whole(line: int, item: str) -> int:
    """Returns the number of a node or element that a field contains. Raises InpError if the field contains no such
    number.
    """
    if not _WHOLE.fullmatch(item) or not int(item):
        raise InpError(f"line {line}: {shortened(item)} is not a number of a node or element; the first one is 1")
    return int(item)


def wholes(line: int, items: list[str]) -> list[int]:
    """Returns the numbers of nodes or elements in several fields. Raises InpError if a field is not such a number."""
    if _WHOLES.fullmatch(",".join(items)):
        with suppress(ValueError):
            found = [int(item) for item in items]
            if all(found):
                return found
    return [whole(line, item) for item in items]


def is_whole(item: str) -> bool:
    """Whether a field is the number of a node or element."""
    return _WHOLE.fullmatch(item) is not None


def shortened(text: str) -> str:
    """Returns the text of a line in quotation marks for a message, shortened if it is long."""
    bare = text.strip()
    return repr(bare if len(bare) <= _LONGEST else f"{bare[:_LONGEST]}...")
