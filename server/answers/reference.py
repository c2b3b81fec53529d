"""Makes docs/reference/http.md, the reference of the HTTP interface, from the OpenAPI document.

``python -m conoid.server.answers.reference`` prints the page.
"""

from collections.abc import Iterator
from typing import Any

from fastapi import FastAPI

from ..app import ROUTERS
from . import openapi

_HEAD = """# HTTP

A server listens at `http://HOST:8750` unless its options name another address. `make reference` makes this page from
the routes; `GET /openapi.json` of a server returns the same content with the schema of each answer.

- A request has the header `Authorization: Bearer TOKEN`, except for `/healthz`, `/readyz`, the JSON schema of a case.
- An error is a JSON document of type `application/problem+json` (RFC 9457); it lists every problem of a case.
- A header `Idempotency-Key` makes a request safe to repeat: the same key and body give the same run.
"""
_TITLES = (
    ("Cases", ("/v1/cases", "/v1/case.schema.json", "/v1/materials")), ("Runs", ("/v1/runs", "/v1/table")),
    ("Sweeps", ("/v1/sweeps",)), ("Files that cases name", ("/v1/files",)), ("The server", ("/",)),
)  # fmt: skip
"""Sections of the page: the title of each section, and the beginnings of the paths of its routes."""
Operation = dict[str, Any]


def page() -> str:
    """Returns the page as Markdown."""
    found: dict[str, list[str]] = {title: [] for title, _ in _TITLES}
    for path, operations in document()["paths"].items():
        title = next(title for title, starts in _TITLES if path.startswith(starts))
        for method, operation in operations.items():
            found[title] += _section(method.upper(), path, operation)
    blocks = [_HEAD]
    for title, sections in found.items():
        blocks += [f"## {title}\n", *sections]
    return "\n".join(blocks)


def document() -> dict[str, Any]:
    """Returns the OpenAPI document of all routes, without a server."""
    app = FastAPI(title="Conoid", version="1")
    for router in ROUTERS:
        app.include_router(router)
    openapi.install(app)
    return app.openapi()


def _section(method: str, path: str, operation: Operation) -> Iterator[str]:
    yield f"### `{method} {path}`\n"
    yield operation.get("description", "").replace("``", "`").strip() + "\n"
    if given := operation.get("parameters", []):
        yield "| parameter | in | value | meaning |\n|---|---|---|---|\n" + "\n".join(map(_row, given)) + "\n"
    if body := operation.get("requestBody"):
        yield f"Body: {', '.join(f'`{kind}`' for kind in body['content'])}.\n"
    good = [_answer(status, answer) for status, answer in sorted(operation["responses"].items()) if status < "400"]
    bad = ", ".join(status for status in sorted(operation["responses"]) if status >= "400")
    yield f"Answers: {'; '.join(good)}. Errors: {bad}.\n"


def _row(parameter: dict[str, Any]) -> str:
    schema = parameter["schema"]
    kinds = [each for each in schema.get("anyOf", [schema]) if each.get("type") != "null"]
    words = [" or ".join(each.get("type", "value") for each in kinds)]
    words += [f"{name} {each[key]}" for each in [*kinds, schema] for key, name in _LIMITS.items() if key in each]
    needed = ["required"] if parameter.get("required") else []
    meaning = parameter.get("description", "").replace("|", "\\|")
    return f"| `{parameter['name']}` | {parameter['in']} | {', '.join(dict.fromkeys([*words, *needed]))} | {meaning} |"


_LIMITS = {"minimum": "at least", "maximum": "at most", "default": "default"}


def _answer(status: str, answer: dict[str, Any]) -> str:
    content = answer.get("content", {})
    schemas = [each.get("schema", {}) for each in content.values()]
    shapes = [schema["$ref"].rsplit("/", 1)[-1] for schema in schemas if "$ref" in schema]
    kinds = ", ".join(f"`{kind}`" for kind in content)
    shape = f" ({', '.join(shapes)})" if shapes else ""
    return f"{status} {kinds}{shape}".strip()


if __name__ == "__main__":
    print(page(), end="")
