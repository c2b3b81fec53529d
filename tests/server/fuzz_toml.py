"""Hook of schemathesis (``SCHEMATHESIS_HOOKS``) that writes a request body in TOML: schemathesis has no writer for
TOML.
"""

import json

import schemathesis
from schemathesis import SerializationContext


@schemathesis.serializer("application/toml")
def write_toml(context: SerializationContext, value: object) -> bytes:
    """Writes text unchanged, also lone surrogates, and writes other data as JSON."""
    if isinstance(value, bytes):
        return value
    text = value if isinstance(value, str) else json.dumps(value, default=str)
    return text.encode("utf-8", "surrogatepass")
