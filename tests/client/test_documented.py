"""Blocks of code in README and docs: cases are valid, Python code compiles and uses existing names, commands exist."""

import ast
import copy
import importlib.util
import re
import shlex
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from typer.testing import CliRunner

import conoid.client
from conoid.cases.reference.json_schema import json_schema
from conoid.client.cli import app

ROOT = Path(__file__).parents[2]
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "ARCHITECTURE.md", *ROOT.glob("docs/**/*.md")])
CLASSES = {"session": "Session", "run": "Run", "result": "Result", "sweep": "Sweep", "found": "Found"}
"""Names of variables in the examples, and the client class of each variable."""


def blocks(path: Path) -> Iterator[tuple[str, str]]:
    """Yields language and text of each fenced block of a page."""
    yield from re.findall(r"^```(\w*)\n(.*?)^```", path.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


def every(language: str) -> list[Any]:
    found = [
        (path.relative_to(ROOT).as_posix(), text) for path in PAGES for lang, text in blocks(path) if lang == language
    ]
    return [pytest.param(text, id=f"{name}-{number}") for number, (name, text) in enumerate(found)]


# Cases


@cache
def partial_schema() -> dict[str, Any]:
    """Returns the schema of cases without required keys, because an excerpt of a case may lack required keys."""

    def relaxed(node: Any) -> Any:
        if isinstance(node, list):
            return [relaxed(each) for each in node]
        if isinstance(node, dict):
            kept = {key: relaxed(value) for key, value in node.items() if key != "required" or isinstance(value, dict)}
            return {"anyOf" if key == "oneOf" else key: value for key, value in kept.items()}
        return node

    schema: dict[str, Any] = relaxed(copy.deepcopy(json_schema()))
    return schema


@pytest.mark.parametrize("text", every("toml"))
def test_a_fragment_of_a_case_has_the_keys_and_types_of_the_schema(text: str) -> None:
    data = tomllib.loads(text)
    if isinstance(parts := data.get("parts"), dict):
        data["parts"] = [parts]
    jsonschema.Draft202012Validator(partial_schema()).validate(data)


def test_a_wrong_key_of_a_fragment_is_found() -> None:
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(partial_schema()).validate({"run": {"end_tme": 1.0}})


# Python


@pytest.mark.parametrize("text", every("python"))
def test_python_compiles_and_names_what_the_client_has(text: str) -> None:
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("conoid"):
            module = importlib.import_module(node.module or "")
            assert all(hasattr(module, alias.name) for alias in node.names)
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in CLASSES:
            known = getattr(conoid.client, CLASSES[node.value.id])
            assert hasattr(known, node.attr) or node.attr in known.__annotations__, ast.unparse(node)


def test_the_reference_of_the_client_has_every_public_name() -> None:
    text = (ROOT / "docs" / "reference" / "python.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"^::: conoid\.client\.(\w+)$", text, re.MULTILINE)) == sorted(conoid.client.__all__)


# Commands


def commands(text: str) -> Iterator[str]:
    """Yields the lines of a block that begin with a program of the project. Prompts and comments are removed from the
    lines; continued lines are joined.
    """
    for line in re.sub(r"\\\n\s*", " ", text).splitlines():
        plain = line.strip().removeprefix("$ ")
        if re.match(r"(conoid|make|mpiexec|python -m)\s", plain):
            yield plain


def written() -> list[Any]:
    """Yields the commands in blocks without a language, and the commands in code font in running text."""
    found: dict[str, str] = {}
    for path in PAGES:
        text = path.read_text(encoding="utf-8")
        spans = re.findall(
            r"(?<!`)`(conoid [^`]+|make \w+)`(?!`)", re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
        )
        shown = [line for language, block in blocks(path) if not language for line in commands(block)]
        found |= {" ".join(line.split()): path.name for line in [*shown, *spans]}
    return [pytest.param(line, id=f"{name}-{line[:60]}") for line, name in found.items()]


def words(line: str) -> list[str]:
    """Returns the words of a command up to a pipe or another operator, without optional words in brackets and without
    three dots.
    """
    plain = re.sub(r"\.\.\.|(?<=\s)\[(?=--)|\](?=[\s.]|$)|[&|;>].*$", " ", line.replace("KEY=VALUE ]", "KEY=VALUE"))
    return shlex.split(plain, comments=True)


def refused(given: list[str]) -> str:
    """Returns the error for a command or an option that does not exist; empty for a valid command. The function runs
    only the help of the command.
    """
    if given[:1] == ["serve"]:  # the options of conoid serve belong to the server
        return ""
    ended = CliRunner().invoke(app, [*given, "--help"])
    return "" if ended.exit_code == 0 or "rgument" in ended.stderr else ended.stderr


@pytest.mark.parametrize("line", written())
def test_a_command_of_the_docs_exists_with_its_options(line: str) -> None:
    given = words(line)
    if given[0] == "conoid":
        assert refused(given[1:]) == ""
    elif given[0] == "make":
        targets = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
        assert [word for word in given[1:2] if word not in targets] == []
    else:
        module = given[len(given) - 1 - given[::-1].index("-m") + 1]
        assert importlib.util.find_spec(module) is not None


@pytest.mark.parametrize("line", ["conoid rnu demo", "conoid run demo --rnaks 2", "conoid figures nothing last"])
def test_a_wrong_command_is_found(line: str) -> None:
    assert "No such" in refused(words(line)[1:])
