"""Journal lines as messages, also those of a newer worker than this client knows."""

from typing import Any

import msgspec

from conoid.cases.messages import AnyMessage, Log, from_json


def from_line(line: bytes | str | msgspec.Raw) -> AnyMessage:
    """The message; one of an unknown type becomes a Log line, so that the numbers stay without a hole.

    Raises msgspec.DecodeError for what is no message at all.
    """
    try:
        return from_json(line)
    except msgspec.ValidationError:
        return unknown(msgspec.json.decode(line))


def unknown(data: Any) -> Log:
    """A message that this client cannot read, as a Log line with its number."""
    if not isinstance(data, dict) or not isinstance(data.get("seq"), int):
        raise msgspec.DecodeError("not a message: it has no seq")
    text = f"a message that this client does not know: {data.get('type')}"
    return Log(
        run=str(data.get("run", "")), seq=data["seq"], wall=float(data.get("wall", 0.0)), level="debug", text=text
    )
