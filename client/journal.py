"""Conversion of lines of a journal to messages, including messages of a newer worker."""

from typing import Any

import msgspec

from conoid.cases.messages import AnyMessage, Log, Status, from_json
from conoid.cases.run import State

_STATES = frozenset(State)


def from_line(line: bytes | str | msgspec.Raw) -> AnyMessage:
    """Returns the message in a line of the journal. A message of an unknown type or state becomes a Log message with
    the same number, so that no number is missing. Raises msgspec.DecodeError for any other line.
    """
    try:
        message = from_json(line)
    except msgspec.ValidationError:
        return unknown(msgspec.json.decode(line))
    if isinstance(message, Status) and message.state not in _STATES:
        text = f"the run is {message.state}, a state that is unknown to this client: {message.message}"
        return Log(run=message.run, seq=message.seq, wall=message.wall, level="warning", text=text)
    return message


def unknown(data: Any) -> Log:
    """Returns a message that this client cannot read as a Log message with the same number."""
    if not isinstance(data, dict) or not isinstance(data.get("seq"), int):
        raise msgspec.DecodeError("not a message, because it has no seq")
    text = f"a message that is unknown to this client: {data.get('type')}"
    wall = data.get("wall")
    at = float(wall) if isinstance(wall, float) else 0.0
    return Log(run=str(data.get("run", "")), seq=data["seq"], wall=at, level="debug", text=text)
