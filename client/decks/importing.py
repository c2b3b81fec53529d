"""Import of a deck: it makes a case and the account of all keywords of the deck."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from conoid.cases.figures import counted
from conoid.cases.load import CaseError, parse_case
from conoid.cases.reading import whole
from conoid.cases.reading.cards import CardError
from conoid.cases.reading.inp import InpError
from conoid.cases.reading.problems import shown

from ..errors import ClientError, UsageError
from . import units
from .account import Account, Entry
from .dialects import Dialect, dialect_of
from .toml import bare, toml

_ERODING = (
    "parts that erode also lose tets by volume and by time step, with the defaults of parts[].erosion; "
    "nodes without tets remain as particles until their first contact"
)


@dataclass(frozen=True)
class Imported:
    """Result of an import: the case as data with comments, the account of every keyword, and the refusals (reasons
    why the case would give a wrong answer).
    """

    deck: Path
    kind: str
    system: units.System
    why: str
    """Reason for which the import has chosen these units."""
    data: dict[str, Any]
    account: Account
    refusals: list[str]

    @property
    def toml(self) -> str:
        """Text of the case file."""
        return toml(self.data)


def read_deck(path: Path, wanted: str | None = None, kind: str | None = None) -> Imported:
    """Imports a deck. ``wanted``: units in the notation of the user; ``kind``: one of DIALECTS, or None to recognise
    the code from the file. Raises UsageError if units are missing or the file is not a deck.
    """
    try:
        dialect = dialect_of(path, kind)(path)
        system, why = _units(dialect, wanted)
        draft = dialect.draft(system)
    except (CardError, InpError) as error:
        raise UsageError(f"{path}: {error}") from None
    except OSError as error:
        raise ClientError(f"{path}: cannot be read: {error.strerror or error}") from None
    account = dialect.account
    account.close()
    data = draft.data()
    if any("erosion" in part for part in data["parts"]):
        account.remarks.append(_ERODING)
    refusals = account.refusals()
    if not data["parts"]:
        refusals.append("the deck has no part of solids")
    if not refusals:
        refusals += _checked(data)
    return Imported(path, dialect.kind, system, why, data, account, refusals)


def _units(dialect: Dialect, wanted: str | None) -> tuple[units.System, str]:
    """Returns the unit system and the reason for it. The system is the one of the user, the one of the deck, or the
    one in which a material is steel.
    """
    own, system = dialect.own_units, None if wanted is None else units.named(wanted)
    if own is not None:
        if system is not None and system != own:
            raise UsageError(f"--units = {wanted!r}: the deck is in {own}")
        return own, "given in the deck"
    if system is not None:
        return system, "given by --units"
    return units.system_of(dialect.weighed())


def _checked(data: dict[str, Any]) -> list[str]:
    """Returns the errors of the imported case, with the same texts as ``conoid validate``."""
    try:
        parse_case(bare(data))
    except CaseError as error:
        return [f"the case would not be valid: {each}" for each in error.problems]
    return []


# The account for users ---------------------------------------------------------------------------------------------


def lines(found: Imported, target: str) -> list[str]:
    """Returns the account of the import as text lines. Each keyword occurs once: a translated keyword with its keys
    in the case, an omitted keyword with the reason.
    """
    account = found.account
    text = [f"{found.deck.name}, {found.kind} -> {target}", f"units: {found.system}: {found.why}"]
    text += [f"note: {each}" for each in account.remarks]
    width = max((len(each.place) for each in account.entries), default=0)
    for title, fate in (("refused", "refused"), ("translated", "taken"), ("not translated", "left")):
        entries = account.of(fate)  # type: ignore[arg-type]
        if entries:
            text += ["", f"{title}: {counted(len(entries), 'keyword')}"]
            text += [line for entry in entries for line in _entry(entry, width)]
    general = [
        line for line in found.refusals if line not in {each for one in account.entries for each in one.refusals()}
    ]
    return [*text, *(["", "refused:"] if general else []), *(f"  {line}" for line in general)]


def _entry(entry: Entry, width: int) -> list[str]:
    notes = "; ".join(entry.reasons) if entry.fate != "taken" else ", ".join(entry.places)
    arrow = " ->" if entry.fate == "taken" else ":"
    words = {"left": "left out", "differs": "differs", "refused": "REFUSED"}
    together: dict[tuple[str, str], list[str]] = {}
    for each in entry.details:
        together.setdefault((words[each.kind], each.why), []).append(each.what)
    details = [f"  {'':{width}} {word}: {', '.join(what)}: {why}" for (word, why), what in together.items()]
    return [f"  {entry.place:<{width}} {entry.keyword}{arrow} {notes}", *details]


def report(found: Imported, target: str) -> dict[str, Any]:
    """Returns the account of the import as plain data, for JSON."""
    return {
        "deck": str(found.deck), "kind": found.kind, "case": target, "units": str(found.system),
        "units_why": found.why, "notes": found.account.remarks, "refused": found.refusals,
        "keywords": [each.data() for each in found.account.entries],
    }  # fmt: skip


def as_json(found: Imported, target: str) -> str:
    """Returns the data of ``report`` as JSON text."""
    return json.dumps(report(found, target), indent=2, ensure_ascii=False) + "\n"


def size_of(path: Path) -> int:
    """Returns the size of a deck in bytes. Raises ClientError if the deck is not a regular file."""
    try:
        with whole.opened(path) as file:
            return file.seek(0, 2)
    except OSError as error:
        raise ClientError(f"deck = {shown(str(path))}: {error.strerror or error}") from None
