"""How schemathesis writes a body of TOML: loaded by it (``SCHEMATHESIS_HOOKS``), which knows no such kind."""

import json

import schemathesis
from schemathesis import SerializationContext


@schemathesis.serializer("application/toml")
def write_toml(context: SerializationContext, value: object) -> bytes:
    """Text as it is, lone surrogates too; what is no text, as JSON writes it."""
    if isinstance(value, bytes):
        return value
    text = value if isinstance(value, str) else json.dumps(value, default=str)
    return text.encode("utf-8", "surrogatepass")
