"""What OpenAPI says of a case: FastAPI sees bytes in the body of a request, since the case is read here, not by it."""

from functools import cache
from typing import Any

from fastapi import FastAPI

from conoid.cases import reference

_CASE = "#/components/schemas/Case"
CASE_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "application/toml": {"schema": {"type": "string", "description": f"A case in TOML; its keys: {_CASE}"}},
            "application/json": {"schema": {"$ref": _CASE}},
        },
    }
}
"""For routes that take a case."""


def install(app: FastAPI) -> None:
    """Adds the schema of a case to what ``app`` says of itself."""
    own = app.openapi

    @cache
    def openapi() -> dict[str, Any]:
        made = own()
        case = reference.json_schema("#/components/schemas/{model}")
        schemas = made.setdefault("components", {}).setdefault("schemas", {})
        schemas |= {**case.pop("$defs"), "Case": case}
        return made

    app.openapi = openapi  # type: ignore[method-assign]
