"""Names in an Abaqus input file.

Abaqus turns a name to upper case and removes its blanks, but keeps text in quotation marks unchanged (Analysis
User's Guide, "Input syntax rules"). If no name matches exactly, names are compared again without regard to the case
of letters.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Label:
    """A name: ``text`` as written in the file, without quotation marks; ``key``, the text that is compared with other
    names.
    """

    text: str
    key: str


def label(written: str) -> Label:
    """Return the name that the text ``written`` of a file contains."""
    bare = written.strip()
    if len(bare) > 1 and bare[0] == bare[-1] == '"':
        return Label(bare[1:-1], bare[1:-1])
    text = _joined(bare)
    return Label(text, text.upper())


class Labelled(Generic[T]):
    """Named values of one scope of a file, in the order in which the file defines them."""

    def __init__(self) -> None:
        """Create an object without values."""
        self._found: dict[str, tuple[Label, T]] = {}

    def __iter__(self) -> Iterator[tuple[Label, T]]:
        """Yield names and values."""
        return iter(self._found.values())

    def add(self, name: Label, value: T) -> T:
        """Add a value with a name and return the value."""
        self._found[name.key] = name, value
        return value

    def get(self, name: Label) -> T | None:
        """Return the value of ``name``; if this name is missing, return the value of the only name that differs from it
        in the case of letters alone.
        """
        if name.key in self._found:
            return self._found[name.key][1]
        alike = [value for each, value in self if each.key.casefold() == name.key.casefold()]
        return alike[0] if len(alike) == 1 else None

    def meant(self, wanted: str) -> list[tuple[Label, T]]:
        """Return the candidates for ``wanted``, a name from outside of the file whose letters may be in any case.

        There are several candidates if names in the file differ only in the case of letters.
        """
        words = {wanted.casefold(), _joined(wanted).casefold()}
        alike = [(name, value) for name, value in self if name.key.casefold() in words]
        exact = [(name, value) for name, value in alike if name.text == wanted]
        return exact or alike


def _joined(text: str) -> str:
    return "".join(text.split())
