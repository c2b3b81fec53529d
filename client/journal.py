"""Journal lines as messages, also those of a newer worker than this client knows."""

from typing import Any

import msgspec

from conoid.cases.messages import AnyMessage, Log, Status, from_json
from conoid.cases.run import State

_STATES = frozenset(State)


def from_line(line: bytes | str | msgspec.Raw) -> AnyMessage:
    """The message; one of an unknown type or state becomes a Log line, so that the numbers stay without a hole.

    Raises msgspec.DecodeError for what is no message at all.
    """
    try:
        message = from_json(line)
    except msgspec.ValidationError:
        return unknown(msgspec.json.decode(line))
    if isinstance(message, Status) and message.state not in _STATES:
        text = f"the run is {message.state}, a state that this client does not know: {message.message}"
        return Log(run=message.run, seq=message.seq, wall=message.wall, level="warning", text=text)
    return message


def unknown(data: Any) -> Log:
    """A message that this client cannot read, as a Log line with its number."""
    if not isinstance(data, dict) or not isinstance(data.get("seq"), int):
        raise msgspec.DecodeError("not a message: it has no seq")
    text = f"a message that this client does not know: {data.get('type')}"
    wall = data.get("wall")
    at = float(wall) if isinstance(wall, float) else 0.0
    return Log(run=str(data.get("run", "")), seq=data["seq"], wall=at, level="debug", text=text)
