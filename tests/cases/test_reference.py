"""The reference of the keys: complete, as the models have it, and true of what the reader accepts."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from conoid.cases.load import read_data, shipped
from conoid.cases.reference import json_schema, page
from conoid.cases.reference.json_schema import FILE, LINE, definition

from .scenes import problems, rod

ROOT = Path(__file__).parents[2]
SCHEMA = json_schema.json_schema()
CHECK = jsonschema.Draft202012Validator(SCHEMA)


def keys(schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every key of every table, with its schema."""
    for name, table in {"Case": schema, **schema["$defs"]}.items():
        for key, each in table.get("properties", {}).items():
            yield f"{name}.{key}", each


@pytest.mark.parametrize(
    ("path", "text"), [("docs/reference/case.md", page.page()), (f"cases/{FILE}", json_schema.schema_text())]
)
def test_what_is_committed_is_what_make_reference_makes(path: str, text: str) -> None:
    assert (ROOT / path).read_text(encoding="utf-8") == text, "run: make reference"


@pytest.mark.parametrize("name", sorted(name for name, _ in keys(SCHEMA)))
def test_every_key_has_a_text(name: str) -> None:
    text = dict(keys(SCHEMA))[name].get("description", "")
    assert text.rstrip().endswith((".", "`")), f"{name}: write a docstring below the field"
    assert "``" not in text


def test_every_table_has_a_text_and_its_keys_on_the_page() -> None:
    text = page.page()
    for table in page.tables(SCHEMA):
        section = text.partition(f"## {table.title}\n")[2].partition("\n## ")[0]
        assert table.schema["description"] in section
        for key in table.schema["properties"]:
            assert f"| `{key}` |" in section, f"{table.title}: {key}"
    assert {id(table.schema) for table in page.tables(SCHEMA)} >= {id(each) for each in SCHEMA["$defs"].values()}


@pytest.mark.parametrize(
    ("section", "row"),
    [
        (
            "`run`",
            "| `end_time` | a time, s, above 0 | required | Simulated time at which the run ends; it begins at 0. |",
        ),
        (
            '`parts[].mesh` with `shape = "cylinder"`',
            "| `base` | 3 of: a length, m | `[0, 0, 0]` | Centre of the",
        ),
        (
            "`parts[].erosion`",
            "| `volume` | list of: a number, above 0 and below 1; a number, above 1 | `[0.1, 10]` |",
        ),
        ("`contact`", "A body overlaps another where their primitives reach into each other"),
        ("`numerics`", '| `viscosity` | table `numerics.viscosity` or `"none"` | its defaults |'),
        ('`boundaries[]` with `kind = "rotation"`', "| `spin` | table `parts[].spin` | required |"),
    ],
)
def test_a_row_has_unit_range_default_and_meaning(section: str, row: str) -> None:
    assert row in page.page().partition(f"## {section}\n")[2].partition("\n## ")[0]


@pytest.mark.parametrize("name", sorted(shipped()))
def test_a_shipped_case_names_the_schema_and_follows_it(name: str) -> None:
    path = shipped()[name]
    mark, _, target = path.read_text(encoding="utf-8").splitlines()[0].partition(" ")
    assert mark == LINE
    assert (path.parent / target).resolve() == ROOT / "cases" / FILE
    assert [error.json_path for error in CHECK.iter_errors(json.loads(json.dumps(read_data(path))))] == []


@pytest.mark.parametrize(
    "override",
    ["contact=none", "numerics.viscosity=none", "run.checkpoint_every=none", "reference[0].value=0.03", "run.ranks=2"],
)
def test_the_schema_allows_what_the_reader_takes(override: str) -> None:
    CHECK.validate(rod(override))


@pytest.mark.parametrize(
    "override",
    [
        "run.end_time=0", "run.end_time=soon", "run.ranks=0", "run.ranks=2.5", "parts[0].mesh.shape=cilinder",
        "parts[0].mesh.sector=third", "parts[0].velocity=[1, 2]", "contact=off", "extra=1", "parts=[]",
        "numerics.dt_safety=1.1", "reference[0].quantity=length", "parts[0].name=3rod",
    ],
)  # fmt: skip
def test_the_schema_refuses_what_the_reader_refuses(override: str) -> None:
    assert problems(override)
    assert not CHECK.is_valid(rod(override))


def test_a_definition_is_found_by_its_reference() -> None:
    assert definition({"$ref": "#/$defs/Wall"}, SCHEMA) is SCHEMA["$defs"]["Wall"]
    assert definition({"type": "integer"}, SCHEMA) == {"type": "integer"}
