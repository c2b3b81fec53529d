"""What a run has said in words since its beginning: log, states and checkpoints, as lines of the journal."""

from collections import deque
from dataclasses import dataclass, field

import msgspec

from conoid.cases.messages import Checkpoint, Log, Status, to_json

from ..runs.journal import DAMAGED

_FIRST, _NEWEST = 200, 800
"""Lines that are kept, from the beginning and from the end. Chosen: what somebody reads, and little to send."""
_LONGEST = 2000
"""Letters of a text that is kept. Chosen: the longest warning of a shipped case has 500."""
_WARNINGS = 200
"""Warnings that are kept, the first ones. Chosen."""
KINDS = frozenset({b'log"', b"stat", b"chec"})
"""First letters of the types of these messages."""

_decode = msgspec.json.Decoder(Log | Status | Checkpoint).decode


@dataclass
class Notes:
    """Bounded: of a long log the lines in the middle are left out, and counted."""

    first: list[bytes] = field(default_factory=list)
    newest: deque[bytes] = field(default_factory=lambda: deque(maxlen=_NEWEST))
    warnings: dict[str, bytes] = field(default_factory=dict)
    """The line of each warning and error by its text: what is said again is there once."""
    left_out: int = 0

    def take(self, line: bytes) -> None:
        """Keeps a line of the journal; one that is damaged is passed over."""
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
        """As it is sent, oldest first."""
        lines = [msgspec.Raw(line) for line in (*self.first, *self.newest)]
        return {"log": lines, "log_left_out": self.left_out, "warnings": list(map(msgspec.Raw, self.warnings.values()))}


def _shortened(message: Log | Status | Checkpoint, line: bytes) -> bytes:
    """A line without what is too long of its text, and without what is no part of the message then."""
    if len(line) <= _LONGEST:
        return line
    texts = {name: text for name in message.__struct_fields__ if isinstance(text := getattr(message, name), str)}
    cut = {name: f"{text[:_LONGEST]} ..." for name, text in texts.items() if len(text) > _LONGEST}
    return to_json(msgspec.structs.replace(message, **cut))
