"""Fields of a keyword by name, and a record of the fields that were read."""

from collections.abc import Sequence
from typing import Generic, TypeVar

from conoid.cases.reading.cards import CardError

from .account import Entry, Remark

Place = TypeVar("Place")
"""Place of a field in the deck: a card, or the number of a text line."""


class Fields(Generic[Place]):
    """Fields of a keyword, by their names in the manual of the code. The method ``rest`` reports fields that are not
    0 and were not read, so that no field is ignored without a message.
    """

    def __init__(self, entry: Entry, found: dict[str, tuple[Place, str]], extra: Sequence[int]) -> None:
        """Stores the fields. ``extra``: numbers of the text lines after the lines with named fields."""
        self.entry = entry
        self.extra = list(extra)
        self._found = found
        self._read: set[str] = set()

    def _real(self, place: Place, item: str, name: str) -> float:
        """Reads a number; the field must not be empty. Raises CardError."""
        raise NotImplementedError

    def _whole(self, place: Place, item: str, name: str) -> int:
        """Reads a whole number; the field must not be empty. Raises CardError."""
        raise NotImplementedError

    def given(self, name: str) -> bool:
        """Returns True if the field exists and is not empty."""
        return name in self._found and bool(self._found[name][1])

    def real(self, name: str, default: float = 0.0) -> float:
        """Reads a number; returns ``default`` for an empty field. Raises CardError."""
        self._read.add(name)
        return self._real(*self._found[name], name) if self.given(name) else default

    def nonzero(self, name: str, default: float) -> float:
        """Reads a number; returns ``default`` for an empty field and for 0. Raises CardError."""
        return self.real(name) or default

    def whole(self, name: str, default: int = 0) -> int:
        """Reads a whole number; returns ``default`` for an empty field. Raises CardError."""
        self._read.add(name)
        return self._whole(*self._found[name], name) if self.given(name) else default

    def text(self, name: str) -> str:
        """Reads the text of a field."""
        self._read.add(name)
        return self._found[name][1] if name in self._found else ""

    def forgive(self, names: str, why: str) -> None:
        """Records that the import omits some fields, with the reason; fields that are 0 are not reported."""
        self._tell("left", names.split(), why)

    def refuse(self, names: str, why: str) -> None:
        """Refuses the import because of fields without which the answer would be wrong."""
        self._tell("refused", names.split(), why)

    def differ(self, name: str, why: str) -> None:
        """Records that a field has a different meaning in Conoid."""
        self._read.add(name)
        self.entry.remark("differs", self._shown(name), why)

    def rest(self, kind: Remark = "refused", why: str = "not translated") -> None:
        """Reports all fields that are not 0 and were not read."""
        self._tell(kind, [name for name in self._found if name not in self._read], why)
        if self.extra:
            self.entry.remark(kind, f"line {self.extra[0]}", "a line of the keyword that is not translated")

    def _tell(self, kind: Remark, names: list[str], why: str) -> None:
        for name in names:
            self._read.add(name)
            if not self._void(name):
                self.entry.remark(kind, self._shown(name), why)

    def _void(self, name: str) -> bool:
        try:
            return not self.given(name) or self._real(*self._found[name], name) == 0.0
        except CardError:
            return False

    def _shown(self, name: str) -> str:
        return f"{name} = {self._found[name][1] if self.given(name) else '(empty)'}"
