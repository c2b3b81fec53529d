"""The messages of a run that the page shows as text: log lines, states and checkpoints, taken from the journal."""

from collections import deque
from dataclasses import dataclass, field

import msgspec

from conoid.cases.messages import Checkpoint, Log, Status, to_json

from ..runs.journal import DAMAGED

_FIRST, _NEWEST = 200, 800
"""Number of log lines that are kept from the beginning and from the end of a log (chosen value)."""
_LONGEST = 2000
"""Largest number of characters of a message; the longest warning of a shipped case has 500 (reason of the chosen
limit)."""
_WARNINGS = 200
"""Largest number of warnings (chosen value); later warnings are dropped."""
KINDS = frozenset({b'log"', b"stat", b"chec"})
"""Beginnings of the message types that the log contains."""

_decode = msgspec.json.Decoder(Log | Status | Checkpoint).decode


@dataclass
class Notes:
    """A log of limited length: the lines in the middle of a long log are dropped and counted."""

    first: list[bytes] = field(default_factory=list)
    newest: deque[bytes] = field(default_factory=lambda: deque(maxlen=_NEWEST))
    warnings: dict[str, bytes] = field(default_factory=dict)
    """Journal lines with warnings and errors, by their text; a text that occurs again is stored once."""
    left_out: int = 0

    def take(self, line: bytes) -> None:
        """Adds a line of the journal; a damaged line is ignored."""
        try:
            message = _decode(line.decode())
        except DAMAGED:
            return
        line = _shortened(message, line)
        room = len(self.warnings) < _WARNINGS
        if room and isinstance(message, Log) and message.level in {"warning", "error"}:
            self.warnings.setdefault(message.text[:_LONGEST], line)
        if len(self.first) < _FIRST:
            self.first.append(line)
        else:
            self.left_out += len(self.newest) == _NEWEST
            self.newest.append(line)

    def shown(self) -> dict[str, object]:
        """Returns the messages of the log as they are sent to the page, oldest first."""
        lines = [msgspec.Raw(line) for line in (*self.first, *self.newest)]
        return {"log": lines, "log_left_out": self.left_out, "warnings": list(map(msgspec.Raw, self.warnings.values()))}


def _shortened(message: Log | Status | Checkpoint, line: bytes) -> bytes:
    """Shortens long texts of a journal line, and removes fields that its message type does not have."""
    if len(line) <= _LONGEST:
        return line
    texts = {name: text for name in message.__struct_fields__ if isinstance(text := getattr(message, name), str)}
    cut = {name: f"{text[:_LONGEST]} ..." for name, text in texts.items() if len(text) > _LONGEST}
    return to_json(msgspec.structs.replace(message, **cut))
