"""The account of an import: for each keyword, whether it was translated, omitted, or is a reason to refuse the
import.
"""

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar

from conoid.cases.reading.included import Line

T = TypeVar("T")
Fate = Literal["taken", "left", "refused"]
Remark = Literal["left", "differs", "refused"]
"""Result of the import for a field of a translated keyword: ``left``: omitted without effect on the answer;
``differs``: translated with a different meaning in Conoid; ``refused``: not translated although the answer depends on
it."""


@dataclass(frozen=True)
class Detail:
    """A field of a keyword that was omitted, has a different meaning in Conoid, or is a reason to refuse the import."""

    kind: Remark
    what: str
    """Field and value as in the deck: ``VP = 1``."""
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
    """Reasons why the keyword was omitted, or why the import is refused."""
    details: list[Detail] = field(default_factory=list)
    barred: bool = False

    @property
    def fate(self) -> Fate:
        """Result of the import for the keyword: it was translated, omitted, or a reason to refuse the import."""
        if self.barred:
            return "refused"
        return "taken" if self.places else "left"

    @property
    def decided(self) -> bool:
        """True if the import has translated, omitted or refused the keyword."""
        return self.barred or bool(self.places or self.reasons)

    def take(self, *places: str) -> None:
        """Records the keys of the case into which the keyword was translated."""
        self.places += [place for place in places if place not in self.places]

    def leave(self, why: str) -> None:
        """Records that the keyword is omitted, with the reason; the omission does not change the answer."""
        self.reasons.append(why)

    def refuse(self, why: str) -> None:
        """Records that a case without the keyword would give a wrong answer."""
        self.barred = True
        self.reasons.append(why)

    def remark(self, kind: Remark, what: str, why: str) -> None:
        """Records what the import did with a field of the keyword."""
        detail = Detail(kind, what, why)
        if detail not in self.details:
            self.details.append(detail)

    @property
    def place(self) -> str:
        """Place of the keyword: ``line 7`` or ``line 7 of mesh.k``."""
        return f"line {self.line} of {self.file}" if self.file else f"line {self.line}"

    def refusals(self) -> Iterator[str]:
        """Yields the reasons for which the keyword refuses the import, one text line each."""
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
    """Record of all keyword lines of a deck: each line once, in the order of the deck."""

    def __init__(self) -> None:
        """Starts an account without entries."""
        self.entries: list[Entry] = []
        self.general: list[str] = []
        """Reasons to refuse the import that belong to no line of the deck."""
        self.remarks: list[str] = []
        """Decisions that belong to no line of the deck, such as units and defaults."""

    def open(self, keyword: str, line: int, file: str = "") -> Entry:
        """Adds an entry for a keyword line, not decided yet; returns the entry."""
        self.entries.append(Entry(keyword, line, file))
        return self.entries[-1]

    def follow(self, keyword: str, lines: Iterable[Line]) -> None:
        """Records the keyword lines that include other files; the import reads the included files."""
        for line in lines:
            self.open(keyword, int(line), line.file).leave("the included file is read as a part of the deck")

    def close(self) -> None:
        """Refuses the import because of each keyword that was neither translated nor omitted."""
        for each in self.entries:
            if not each.decided:
                each.refuse("unknown keyword, which may change the result")

    def without(self, solid: Iterable[str], parts: Collection[str]) -> None:
        """Refuses the import if a part with solid elements (``solid``) is not defined in the deck: its solids would
        belong to no body.
        """
        if lost := sorted({number for number in solid if number not in parts}, key=int):
            self.general.append(
                f"solids of the part {', '.join(lost)} would be lost: the deck does not define the part"
            )

    def of(self, fate: Fate) -> list[Entry]:
        """Returns the entries of the keywords that were translated, omitted or refused (``fate``)."""
        return [each for each in self.entries if each.fate == fate]

    def refusals(self) -> list[str]:
        """Reasons why the import is refused, one text line each."""
        return [*self.general, *(line for each in self.entries for line in each.refusals())]


def once(known: Collection[T], number: T, what: str) -> T:
    """Returns ``number`` if it is not yet defined. Raises ValueError if ``known`` contains it."""
    if number in known:
        raise ValueError(f"the {what} {number} is defined twice")
    return number
