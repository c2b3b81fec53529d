"""The reference of keys of a case: complete, generated from the models, and consistent with the reader of cases."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from conoid.cases.load import parse_case, read_data, shipped, toml_data
from conoid.cases.reference import json_schema, page
from conoid.cases.reference.examples import EXAMPLES, SMALLEST
from conoid.cases.reference.json_schema import FILE, LINE, definition
from conoid.cases.reference.tables import tables

from .scenes import problems, rod

ROOT = Path(__file__).parents[2]
SCHEMA = json_schema.json_schema()
CHECK = jsonschema.Draft202012Validator(SCHEMA)


def keys(schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yields every key of every table of a case, with the schema of the key."""
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


def test_every_table_and_key_stands_on_the_page() -> None:
    """Each key is below the heading of its table, or in the list of variants if another table has the same keys."""
    text = page.page()
    for table in tables(SCHEMA):
        chapter = text.partition(f"### `{table.path}`\n" if table.path else "## The case\n")[2].partition("\n### ")[0]
        heading = f"#### {table.title}\n"
        assert table.schema["description"].partition("docs/")[0] in chapter or f"| `{table.value}` | " in chapter
        assert not table.key or heading in chapter or f"| `{table.value}` | " in chapter
        for key in table.schema["properties"]:
            assert f"`{key}`" in chapter, f"{table.title}: {key}"
    assert {id(table.schema) for table in tables(SCHEMA)} >= {id(each) for each in SCHEMA["$defs"].values()}


def test_every_link_of_the_page_has_its_heading() -> None:
    text = page.page()
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    anchors = {re.sub(r"[^a-z0-9_ -]", "", heading.lower()).replace(" ", "-") for heading in headings}
    assert set(re.findall(r"\]\(#(.*?)\)", text)) <= anchors


@pytest.mark.parametrize(
    ("section", "row"),
    [
        ("### `run`", "| `end_time` | a time, s, above 0 | required | Simulated time at which the run ends."),
        (
            '#### `parts[].mesh` with `shape = "cylinder"`',
            "| `base` | 3 values: a length, m | `[0, 0, 0]` | Centre of the",
        ),
        (
            "### `parts[].erosion`",
            "| `volume` | list of: a number, above 0 and below 1; a number, above 1 | `[0.1, 10]` |",
        ),
        ("### `contact`", "Two bodies overlap where their primitives intersect"),
        (
            "### `numerics`",
            '| `viscosity` | table [`numerics.viscosity`](#numericsviscosity) or `"none"` | its defaults |',
        ),
        ('#### `boundaries[]` with `kind = "rotation"`', "| `spin` | table [`parts[].spin`](#partsspin) | required |"),
        (
            "### `bond[]`",
            "| a stress, Pa, above 0 | – | Tensile strength: the interface breaks at this normal traction.",
        ),
        ("### `parts[].mesh`", "| all except two_tets, shards"),
        ("### `parts[].mesh.of[]`", "| `box` | `low`, `high` | [`parts[].mesh`](#partsmesh) |"),
    ],
)
def test_a_row_has_unit_range_default_and_meaning(section: str, row: str) -> None:
    assert row in page.page().partition(f"{section}\n")[2].partition("\n## ")[0]


def with_example(example: str) -> dict[str, Any]:
    """Returns the smallest case with an example added: keys of an existing part are replaced, entries of other lists
    are added.
    """
    data, piece = toml_data(SMALLEST), toml_data(example)
    parts = {part["name"]: part for part in data["parts"]}
    for part in piece.pop("parts", []):
        mesh = (
            {"mesh": parts[part["name"]]["mesh"] | part.get("mesh", {})} if "shape" not in part.get("mesh", {}) else {}
        )
        parts[part["name"]].update(part | mesh)
    for key, value in piece.items():
        data[key] = data.get(key, {}) | value if isinstance(value, dict) else [*data.get(key, []), *value]
    return data


@pytest.mark.parametrize("title", ["smallest", *EXAMPLES])
def test_an_example_is_a_valid_case_and_changes_it(title: str) -> None:
    data = with_example(EXAMPLES.get(title, ""))
    parse_case(data)
    assert title in {"smallest", *(table.title for table in tables(SCHEMA))}
    assert (data == toml_data(SMALLEST)) == (title == "smallest")


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
