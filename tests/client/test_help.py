"""The help of the commands: every command is in a group, has one line of description, and has examples that are
valid.
"""

import re
import shlex
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from conoid.client.cli import app
from conoid.client.commands.helping import EXAMPLES, GROUPS

ROOT: Any = typer.main.get_command(app)
NAMES = [name for name in ROOT.commands if not ROOT.commands[name].hidden]
WIDTH = 60
"""Largest number of characters of a help text beside the longest name on a terminal of 80 characters."""


def test_the_help_has_all_commands_in_groups_a_line_each() -> None:
    printed = CliRunner().invoke(app, ["--help"], terminal_width=80).stdout
    assert "More:" not in printed
    for title, names in GROUPS.items():
        assert f"{title}:\n" in printed or not set(names) & set(NAMES)
    for name in NAMES:
        assert len(re.findall(rf"^  {name} +[A-Z].*[^.]\.$", printed, re.MULTILINE)) == 1, name


@pytest.mark.parametrize("name", NAMES)
def test_examples_of_a_command_use_what_it_has(name: str) -> None:
    command = ROOT.get_command(None, name)
    assert len(command.get_short_help_str(limit=200)) <= WIDTH
    if name != "serve":
        assert EXAMPLES[name]
    for line in EXAMPLES.get(name, ()):
        words = shlex.split(line.strip())
        assert line.startswith(" ") or words[:2] == ["conoid", name]
        used, known = command, command.params
        if hasattr(command, "commands") and len(words) > 2 and words[2] in command.commands:
            known = [*command.params, *command.commands[words[2]].params]
        elif hasattr(used, "commands"):
            assert len(words) == 2 or words[2].startswith("--"), line
        options = {option for param in known for option in param.opts} | {"--help"}
        assert {word.partition("=")[0] for word in words if word.startswith("--")} <= options, line
