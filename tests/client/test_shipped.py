"""Files of the installation on the command line: keys, cases, materials, the version, completions for the shell."""

import json
from importlib import metadata
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from conoid.cases.load import materials, read_case, shipped
from conoid.cases.reference import json_schema, page
from conoid.client.cli import app


def conoid(*words: object, **variables: str) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words], env=variables, prog_name="conoid")


def test_the_version_is_that_of_the_package() -> None:
    assert conoid("--version").stdout == f"conoid {metadata.version('conoid')}\n"


def test_the_schema_and_the_page_are_printed_or_written(quiet_home: Path) -> None:
    assert conoid("schema").stdout == json_schema.schema_text()
    assert conoid("schema", "--page", "--out", "keys.md").stdout == ""
    assert (quiet_home / "keys.md").read_text() == page.page()
    refused = conoid("schema", "--out", "no/keys.json")
    assert (refused.exit_code, refused.stderr) == (
        1,
        "conoid: no/keys.json: cannot be written: No such file or directory\n",
    )


def test_every_shipped_case_is_listed() -> None:
    listed = conoid("cases")
    assert listed.exit_code == 0, listed.output
    assert {line.split()[0] for line in listed.stdout.splitlines()[2:] if line[0] != " "} == set(shipped())
    assert [each["name"] for each in json.loads(conoid("cases", "--json").stdout)] == sorted(shipped())


def test_a_copy_is_the_case_and_names_the_schema_beside_it(quiet_home: Path) -> None:
    assert conoid("cases", "copy", "demo").stdout == "demo.toml\ncase.schema.json\n"
    copy = quiet_home / "demo.toml"
    assert read_case(copy) == read_case(shipped()["demo"])
    assert copy.read_text().startswith("#:schema ./case.schema.json\n")
    assert (quiet_home / "case.schema.json").read_text() == json_schema.schema_text()
    copy.write_text("mine")
    again = conoid("cases", "copy", "demo")
    assert (again.exit_code, again.stderr) == (1, "conoid: demo.toml already exists; name another file with --out\n")
    assert copy.read_text() == "mine"
    assert conoid("cases", "copy", "demo", "--out", "other.toml").exit_code == 0


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (
            ("cases", "copy", "taylor_coper"),
            2,
            "conoid: case = 'taylor_coper': no shipped case of this name; did you mean",
        ),
        (
            ("cases", "copy", "demo", "--out", "demo.json"),
            2,
            "conoid: --out = 'demo.json': the name of a case file ends in",
        ),
        (("materials", "stel"), 2, "conoid: material = 'stel': unknown material; did you mean 'steel'?"),
    ],
)
def test_a_missing_object_is_one_line(words: tuple[str, ...], code: int, message: str, quiet_home: Path) -> None:
    result = conoid(*words)
    assert result.exit_code == code
    assert result.stderr.startswith(message)
    assert len(result.stderr.splitlines()) == 1
    assert list(quiet_home.iterdir()) == []


def test_materials_are_listed_and_shown_with_their_sources() -> None:
    assert {line.split()[0] for line in conoid("materials").stdout.splitlines()[2:] if line[0] != " "} == set(
        materials()
    )
    assert json.loads(conoid("materials", "--json").stdout) == materials()
    shown = conoid("materials", "steel_4340").stdout
    assert "elastic.young" in shown
    assert "205 GPa" in shown
    assert "github.com/Uintah/Uintah" in shown
    young = next(
        each for each in json.loads(conoid("materials", "wha", "--json").stdout) if each["key"] == "elastic.young"
    )
    assert (young["value"], young["confidence"], young["source"]) == ("389.16 GPa", "paper", "moon_kim_lee")


@pytest.mark.parametrize(
    ("words", "names"),
    [
        ("conoid validate taylor_c", ["taylor_copper", "taylor_copper_split"]),
        ("conoid cases copy lo", ["long_rod"]),
        ("conoid materials steel_1", ["steel_1006"]),
        ("conoid validate my", ["my.toml", "my_cases/"]),
        ("conoid validate my_cases/", ["my_cases/a.json"]),
    ],
)
def test_the_shell_completes_names(words: str, names: list[str], quiet_home: Path) -> None:
    (quiet_home / "my_cases").mkdir()
    for name in ("my.toml", "my.txt", "my_cases/a.json"):
        (quiet_home / name).touch()
    count = str(len(words.split()) - 1)
    result = conoid(_CONOID_COMPLETE="complete_bash", COMP_WORDS=words, COMP_CWORD=count)
    assert result.stdout.split() == names
