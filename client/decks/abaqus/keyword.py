"""A keyword of an Abaqus input file with its parameters and data lines. The object ``Keyword`` records which of its
parameters were read."""

from dataclasses import dataclass, field

from conoid.cases.reading.inp import InpError, fields, numbers

from ..account import Entry

Row = tuple[int, str]


@dataclass
class Keyword:
    """``word``: keyword in the spelling of the manual; ``scope``: name of the part or instance that contains the
    keyword, empty outside of parts and instances.
    """

    word: str
    line: int
    parameters: dict[str, str | None]
    rows: list[Row]
    entry: Entry
    scope: str = ""
    material: str = ""
    step: int = 0
    """Number of the step that contains the keyword, from 1; 0 for a keyword outside of steps."""
    _read: set[str] = field(default_factory=set)

    def get(self, name: str) -> str | None:
        """Returns the value of a parameter without quotation marks: empty for a parameter without value, None if the
        parameter is missing.
        """
        joined = "".join(name.split())
        self._read.add(joined)
        if joined not in self.parameters:
            return None
        return (self.parameters[joined] or "").strip().strip('"')

    def has(self, name: str) -> bool:
        """Returns True if the keyword has a parameter ``name``."""
        return self.get(name) is not None

    def key(self, name: str) -> str:
        """Returns the value of a parameter in the form for comparisons of names: without blanks, in upper case."""
        return joined(self.get(name) or "")

    def forgive(self, names: str, why: str) -> None:
        """Records parameters that the import omits, with the reason."""
        for name in names.split(","):
            if (value := self.get(name)) is not None:
                self.entry.remark("left", f"{name.strip()} = {value}" if value else name.strip(), why)

    def rest(self) -> None:
        """Refuses the import if the keyword has parameters that were not read."""
        for name in self.parameters:
            if name not in self._read:
                self.entry.remark("refused", name, "this parameter is not translated")

    def filled(self) -> list[Row]:
        """Data lines of the keyword that are not empty."""
        return [row for row in self.rows if row[1].strip()]

    def table(self, columns: int) -> list[list[float]]:
        """Reads the numbers of the data lines. Raises InpError if a line has more than ``columns`` values."""
        found = [(line, numbers(line, text)) for line, text in self.filled()]
        for line, row in found:
            if any(row[columns:]):
                raise InpError(
                    f"line {line}: {len(row)} values; at most {columns} are translated, without temperatures and fields"
                )
        return [(row + [0.0] * columns)[:columns] for _, row in found]

    def single(self, columns: int) -> list[float]:
        """Reads the numbers of the keyword's only data line. Raises InpError unless the keyword has exactly one data
        line.
        """
        found = self.table(columns)
        if len(found) != 1:
            raise InpError(f"line {self.line}: *{self.word} has {len(found)} data lines; one is translated")
        return found[0]

    def lists(self) -> list[tuple[int, list[str]]]:
        """Fields of each data line, with the number of the line."""
        return [(line, fields(text)) for line, text in self.filled()]


def joined(text: str) -> str:
    """Returns a name in the form for comparisons: without blanks and quotation marks, in upper case."""
    return "".join(text.strip().strip('"').split()).upper()
