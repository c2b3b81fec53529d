"""Text of a Radioss starter deck. The text consists of blocks. A block is a keyword line, which begins with ``/``, and
the lines after it.

Rules of the Altair Radioss Reference Guide, "Starter input": a line that begins with ``/`` is a keyword, and the words
of the keyword are divided by ``/``. A line that begins with ``#`` or ``$`` is a comment. Fields are 10 columns wide for
integers and 20 columns wide for other values.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

from conoid.cases.reading.included import Included, flattened, included_by
from conoid.cases.reading.problems import shown

from ...errors import MeshError

NUMBER, REAL = 10, 20
"""Width of the field of an integer, and width of the field of a floating point number, in columns."""
_LARGEST = 2**53
"""Upper bound of integers in a deck."""


@dataclass
class Block:
    """Block of a deck: the words of its keyword in upper case, the number of the keyword's line, and the following
    lines with their numbers.
    """

    words: list[str]
    line: int
    rows: list[tuple[int, str]] = field(default_factory=list)

    @property
    def kind(self) -> str:
        """Words of the keyword before the first number, such as ``GRNOD/NODE``."""
        names = [word for word in self.words if not word.isdecimal()]
        return "/".join(names)

    @property
    def id(self) -> int:
        """First number among the words of the keyword. Raises MeshError if no word of the keyword is a number."""
        found = next((word for word in self.words if word.isdecimal()), None)
        if found is None or not 0 < int(found) < _LARGEST:
            raise MeshError(f"line {self.line}: /{'/'.join(self.words)} has no number")
        return int(found)

    def titled(self) -> tuple[str, list[tuple[int, str]]]:
        """Return the title, which is the first line, and the following lines that are not empty."""
        title = self.rows[0][1].strip() if self.rows else ""
        return title, [(number, text) for number, text in self.rows[1:] if text.strip()]


def blocks(deck: Included) -> Iterator[Block]:
    """Yield the blocks of a deck and of the files that it includes, up to ``/END``. Raises MeshError."""
    block: Block | None = None
    try:
        for number, text in flattened(deck, included_by):
            if text.startswith(("#", "$")):
                continue
            if text.startswith("/"):
                if block is not None:
                    yield block
                block = Block([word.strip().upper() for word in text.strip().strip("/").split("/")], number)
                if block.words == ["END"]:
                    return
            elif block is not None:
                block.rows.append((number, text))
            elif text.strip():
                raise MeshError(f"line {number}: {shown(text.strip())} is before the first keyword")
    except ValueError as error:
        raise error if isinstance(error, MeshError) else MeshError(str(error)) from None
    if block is None:
        raise MeshError("the file has no keyword; this is no starter deck")
    yield block


def wholes(line: int, text: str) -> list[int]:
    """Return the integers of a line with fields of 10 columns; an empty field gives 0. Raises MeshError."""
    if "\t" in text:
        raise MeshError(f"line {line}: a tab among fields of fixed widths; write blanks")
    items = [text[k : k + NUMBER].strip() for k in range(0, len(text.rstrip()), NUMBER)]
    for item in items:
        if (item and not item.removeprefix("-").isdecimal()) or len(item) > NUMBER:
            raise MeshError(f"line {line}: {shown(item)} is not a whole number (fields have 10 columns)")
    return [int(item or 0) for item in items]


def number(line: int, text: str, what: str) -> int:
    """Return the number of a node, an element or a part. Raises MeshError if the number is not positive."""
    found = wholes(line, text[:NUMBER])
    if not found or not 0 < found[0] < _LARGEST:
        raise MeshError(f"line {line}: {shown(text[:NUMBER].strip())} is no number of {what}; the first one is 1")
    return found[0]


def point(line: int, text: str) -> list[float]:
    """Return the three coordinates of a node, in fields of 20 columns after the number of the node. Raises
    MeshError.
    """
    items = [text[k : k + REAL].strip() for k in range(NUMBER, NUMBER + 3 * REAL, REAL)]
    if "\t" in text or text[NUMBER + 3 * REAL :].strip():
        raise MeshError(f"line {line}: a node has a number of 10 columns and three coordinates of 20")
    try:
        if any("_" in item for item in items):
            raise ValueError
        return [float(item.translate(_D)) if item else 0.0 for item in items]
    except ValueError:
        raise MeshError(f"line {line}: {shown(text.strip())} has no three coordinates (fields of 20 columns)") from None


_D = str.maketrans("dD", "ee")
