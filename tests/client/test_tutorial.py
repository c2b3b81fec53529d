"""The tutorial: its pieces are a case that is sound, follows the schema, and is estimated as it says."""

import re
from pathlib import Path

import jsonschema
from typer.testing import CliRunner

from conoid.cases.estimate import estimate
from conoid.cases.load import parse_case, toml_data
from conoid.cases.plausible import doubts
from conoid.cases.reference import json_schema
from conoid.client.cli import app

TEXT = (Path(__file__).parents[2] / "docs" / "tutorial.md").read_text(encoding="utf-8")
CASE = "\n".join(re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL))


def test_the_pieces_are_a_sound_case() -> None:
    data = toml_data(CASE)
    case = parse_case(data)
    assert doubts(data, case, estimate(case)) == []
    jsonschema.Draft202012Validator(json_schema()).validate(data)


def test_what_it_shows_is_what_is_printed(quiet_home: Path) -> None:
    (quiet_home / "tile.toml").write_text(CASE)
    shown = re.search(r"```\n(tile: valid\n.*?)```", TEXT, re.DOTALL)
    assert shown is not None
    printed = CliRunner().invoke(app, ["validate", "tile.toml"])
    assert [line.rstrip() for line in printed.stdout.splitlines()] == shown[1].splitlines()
    warned = CliRunner().invoke(app, ["validate", "tile.toml", "--set", "run.end_time=15"])
    assert warned.stderr.splitlines()[0] in TEXT.splitlines()
