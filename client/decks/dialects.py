"""The codes whose decks can be imported, and the recognition of the code from a file."""

import itertools
from collections.abc import Iterable
from pathlib import Path
from typing import Protocol

from conoid.cases.reading.included import lines
from conoid.cases.reading.problems import shown
from conoid.cases.reading.similar import choices

from ..errors import UsageError
from .abaqus.reading import Abaqus
from .account import Account
from .draft import Draft
from .lsdyna.reading import LsDyna
from .radioss.reading import Radioss
from .units import System, Weighed

_LOOKED = 2000
"""Number of lines at the start of a file that are searched (chosen value: longer than the comments at the top of any
deck)."""


class Dialect(Protocol):
    """A deck of one code after reading."""

    kind: str
    account: Account

    def __init__(self, path: Path) -> None:
        """Reads the deck. Raises CardError, InpError, OSError."""

    @property
    def own_units(self) -> System | None:
        """Unit system that the deck names; None if the deck names none."""

    def weighed(self) -> Iterable[Weighed]:
        """Densities and Young's moduli of the materials of the deck."""

    def draft(self, system: System) -> Draft:
        """Returns the case; afterwards ``account`` has a decision for every keyword."""


DIALECTS: dict[str, type[Dialect]] = {"lsdyna": LsDyna, "abaqus": Abaqus, "radioss": Radioss}
_ENDINGS = {".k": "lsdyna", ".key": "lsdyna", ".dyn": "lsdyna", ".inp": "abaqus", ".rad": "radioss"}
_LSDYNA = ("*KEYWORD", "*TITLE", "*CONTROL_", "*NODE", "*PART", "*INCLUDE", "*PARAMETER", "*COMMENT")
_ABAQUS = ("*HEADING", "*PREPRINT", "*PART,", "*NODE,", "*ASSEMBLY", "*ELEMENT,", "*PARAMETER")


def dialect_of(path: Path, wanted: str | None) -> type[Dialect]:
    """Returns the code of a deck: the given one, or the one recognised from the first lines and the file name.
    Raises UsageError, OSError.
    """
    found = wanted or _detected(path)
    if found not in DIALECTS:
        raise UsageError(f"--format = {shown(found)}: allowed: {choices(list(DIALECTS))}")
    return DIALECTS[found]


def _detected(path: Path) -> str:
    try:
        head = [text.strip() for _, text in itertools.islice(lines(path), _LOOKED)]
    except ValueError as error:
        raise UsageError(f"{path}: {error}") from None
    first = next((text.upper() for text in head if text and not text.startswith(("$", "**", "#"))), "")
    if any(text.startswith(("/BEGIN", "#RADIOSS")) for text in head):
        return "radioss"
    if first.startswith("*KEYWORD"):
        return "lsdyna"
    by_name = _ENDINGS.get(path.suffix.lower())
    if by_name is not None and first.startswith(("*", "/")):
        return by_name
    if first.startswith(_ABAQUS) and not any(text.startswith("$") for text in head):
        return "abaqus"
    if first.startswith(_LSDYNA):
        return "lsdyna"
    raise UsageError(
        f"{path}: not recognised as an LS-DYNA keyword deck, an Abaqus input file or a Radioss starter; "
        f"allowed with --format: {choices(list(DIALECTS))}"
    )
