"""What became of a deck, keyword by keyword: taken over, left out, or a reason to refuse the import."""

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar

from conoid.cases.reading.included import Line

T = TypeVar("T")
Fate = Literal["taken", "left", "refused"]
Remark = Literal["left", "differs", "refused"]
"""Of a part of a keyword that is taken over: a value that is left out, one that means something else here, or one
without which the case would answer wrong."""


@dataclass(frozen=True)
class Detail:
    """A field of a keyword that was not taken over as it is."""

    kind: Remark
    what: str
    """``VP = 1``."""
    why: str


@dataclass
class Entry:
    """A keyword line of a deck and what became of it."""

    keyword: str
    line: int
    file: str = ""
    """The included file, as the deck names it; empty for the deck itself."""
    places: list[str] = field(default_factory=list)
    """Keys of the case that it went into."""
    reasons: list[str] = field(default_factory=list)
    """Why it was left out, or why the import is refused."""
    details: list[Detail] = field(default_factory=list)
    barred: bool = False

    @property
    def fate(self) -> Fate:
        """What became of the keyword as a whole."""
        if self.barred:
            return "refused"
        return "taken" if self.places else "left"

    @property
    def decided(self) -> bool:
        """Whether anything was said of it."""
        return self.barred or bool(self.places or self.reasons)

    def take(self, *places: str) -> None:
        """It went into these keys of the case."""
        self.places += [place for place in places if place not in self.places]

    def leave(self, why: str) -> None:
        """It is left out, which makes no other answer, or is told here."""
        self.reasons.append(why)

    def refuse(self, why: str) -> None:
        """A case without it would answer wrong."""
        self.barred = True
        self.reasons.append(why)

    def remark(self, kind: Remark, what: str, why: str) -> None:
        """What became of one of its fields."""
        detail = Detail(kind, what, why)
        if detail not in self.details:
            self.details.append(detail)

    @property
    def place(self) -> str:
        """``line 7`` or ``line 7 of mesh.k``."""
        return f"line {self.line} of {self.file}" if self.file else f"line {self.line}"

    def refusals(self) -> Iterator[str]:
        """Why the import is refused because of it, a line each."""
        if self.barred:
            yield f"{self.place}, {self.keyword}: {'; '.join(self.reasons)}"
        for each in self.details:
            if each.kind == "refused":
                yield f"{self.place}, {self.keyword}, {each.what}: {each.why}"

    def data(self) -> dict[str, Any]:
        """As plain data, for JSON."""
        return {
            "keyword": self.keyword, "file": self.file, "line": self.line, "fate": self.fate, "keys": self.places,
            "why": "; ".join(self.reasons),
            "details": [{"kind": each.kind, "what": each.what, "why": each.why} for each in self.details],
        }  # fmt: skip


class Account:
    """Every keyword line of a deck once, in the order of the deck."""

    def __init__(self) -> None:
        """Nothing has been read yet."""
        self.entries: list[Entry] = []
        self.general: list[str] = []
        """Reasons to refuse that belong to no line."""
        self.remarks: list[str] = []
        """What was decided that belongs to no line: units, defaults."""

    def open(self, keyword: str, line: int, file: str = "") -> Entry:
        """The entry of a keyword line, to be decided."""
        self.entries.append(Entry(keyword, line, file))
        return self.entries[-1]

    def follow(self, keyword: str, lines: Iterable[Line]) -> None:
        """The lines that include other files, which are read."""
        for line in lines:
            self.open(keyword, int(line), line.file).leave("the file is read as a part of the deck")

    def close(self) -> None:
        """What nothing was said of is not known, and refuses the import."""
        for each in self.entries:
            if not each.decided:
                each.refuse("this keyword is not known here; it may change the answer")

    def without(self, solid: Iterable[str], parts: Collection[str]) -> None:
        """Numbers of parts that have solids, and those that are defined: solids of others are in no body."""
        if lost := sorted({number for number in solid if number not in parts}, key=int):
            self.general.append(f"solids of the part {', '.join(lost)} would be lost: the deck does not define it")

    def of(self, fate: Fate) -> list[Entry]:
        """The keywords of one fate."""
        return [each for each in self.entries if each.fate == fate]

    def refusals(self) -> list[str]:
        """Every reason why the import is refused, a line each."""
        return [*self.general, *(line for each in self.entries for line in each.refusals())]


def once(known: Collection[T], number: T, what: str) -> T:
    """A number that nothing of its kind has yet. Raises ValueError."""
    if number in known:
        raise ValueError(f"the {what} {number} is defined twice")
    return number
