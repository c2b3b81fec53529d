"""The account of an import, keyword by keyword: translated, omitted, or a reason to refuse the import."""

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar

from conoid.cases.reading.included import Line

T = TypeVar("T")
Fate = Literal["taken", "left", "refused"]
Remark = Literal["left", "differs", "refused"]
"""Fate of a field of a translated keyword: omitted, with a different meaning in Conoid, or necessary for a right
answer."""


@dataclass(frozen=True)
class Detail:
    """A field of a keyword that was not translated unchanged."""

    kind: Remark
    what: str
    """The field as in the deck: ``VP = 1``."""
    why: str


@dataclass
class Entry:
    """A keyword line of a deck and its translation."""

    keyword: str
    line: int
    file: str = ""
    """Name of the included file in the deck; empty for the deck itself."""
    places: list[str] = field(default_factory=list)
    """Keys of the case into which the keyword was translated."""
    reasons: list[str] = field(default_factory=list)
    """Reason why the keyword was omitted, or why the import is refused."""
    details: list[Detail] = field(default_factory=list)
    barred: bool = False

    @property
    def fate(self) -> Fate:
        """Fate of the keyword as a whole."""
        if self.barred:
            return "refused"
        return "taken" if self.places else "left"

    @property
    def decided(self) -> bool:
        """True if the keyword has been decided."""
        return self.barred or bool(self.places or self.reasons)

    def take(self, *places: str) -> None:
        """Records the keys of the case into which the keyword was translated."""
        self.places += [place for place in places if place not in self.places]

    def leave(self, why: str) -> None:
        """Records that the keyword is omitted without an effect on the answer, or with a note."""
        self.reasons.append(why)

    def refuse(self, why: str) -> None:
        """Records that a case without the keyword would give a wrong answer."""
        self.barred = True
        self.reasons.append(why)

    def remark(self, kind: Remark, what: str, why: str) -> None:
        """Records the fate of a field of the keyword."""
        detail = Detail(kind, what, why)
        if detail not in self.details:
            self.details.append(detail)

    @property
    def place(self) -> str:
        """Place of the keyword: ``line 7`` or ``line 7 of mesh.k``."""
        return f"line {self.line} of {self.file}" if self.file else f"line {self.line}"

    def refusals(self) -> Iterator[str]:
        """Returns the reasons for which the keyword refuses the import, a line each."""
        if self.barred:
            yield f"{self.place}, {self.keyword}: {'; '.join(self.reasons)}"
        for each in self.details:
            if each.kind == "refused":
                yield f"{self.place}, {self.keyword}, {each.what}: {each.why}"

    def data(self) -> dict[str, Any]:
        """The entry as plain data, for JSON."""
        return {
            "keyword": self.keyword, "file": self.file, "line": self.line, "fate": self.fate, "keys": self.places,
            "why": "; ".join(self.reasons),
            "details": [{"kind": each.kind, "what": each.what, "why": each.why} for each in self.details],
        }  # fmt: skip


class Account:
    """Record of all keyword lines of a deck, each once, in the order of the deck."""

    def __init__(self) -> None:
        """Starts without entries."""
        self.entries: list[Entry] = []
        self.general: list[str] = []
        """Reasons to refuse without a line of the deck."""
        self.remarks: list[str] = []
        """Decisions without a line of the deck: units, defaults."""

    def open(self, keyword: str, line: int, file: str = "") -> Entry:
        """Returns the entry of a keyword line, to be decided."""
        self.entries.append(Entry(keyword, line, file))
        return self.entries[-1]

    def follow(self, keyword: str, lines: Iterable[Line]) -> None:
        """Records the lines that include other files, which are read."""
        for line in lines:
            self.open(keyword, int(line), line.file).leave("the file is read as a part of the deck")

    def close(self) -> None:
        """Refuses the import for keywords that have not been decided."""
        for each in self.entries:
            if not each.decided:
                each.refuse("unknown keyword, which may change the result")

    def without(self, solid: Iterable[str], parts: Collection[str]) -> None:
        """Numbers of parts that have solid elements, and of defined parts: other solids are in no body."""
        if lost := sorted({number for number in solid if number not in parts}, key=int):
            self.general.append(f"solids of the part {', '.join(lost)} would be lost: the deck does not define it")

    def of(self, fate: Fate) -> list[Entry]:
        """Returns the keywords of one fate."""
        return [each for each in self.entries if each.fate == fate]

    def refusals(self) -> list[str]:
        """Every reason why the import is refused, a line each."""
        return [*self.general, *(line for each in self.entries for line in each.refusals())]


def once(known: Collection[T], number: T, what: str) -> T:
    """Returns a number that no other of its kind has yet. Raises ValueError."""
    if number in known:
        raise ValueError(f"the {what} {number} is defined twice")
    return number
