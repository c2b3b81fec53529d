"""The command ``conoid runs``: filters, columns, and short ids, which every command accepts."""

from datetime import datetime
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from conoid.client.cli import app
from conoid.client.commands.times import moment
from conoid.client.errors import UsageError
from conoid.client.local.own_server import LocalServer

from .fakes import case_file

NOW = datetime(2026, 11, 30, 12, 0)


@pytest.mark.parametrize(
    ("text", "when"),
    [
        ("2026-11-28", datetime(2026, 11, 28)), ("2026-11-28 14:30", datetime(2026, 11, 28, 14, 30)),
        ("today", datetime(2026, 11, 30)), ("Yesterday", datetime(2026, 11, 29)), ("3d", datetime(2026, 11, 27, 12)),
        ("12h", datetime(2026, 11, 30)), ("2 weeks", datetime(2026, 11, 16, 12)),
        ("90 min", datetime(2026, 11, 30, 10, 30)),
    ],
)  # fmt: skip
def test_moments_are_dates_and_how_long_ago(text: str, when: datetime) -> None:
    assert moment(text, "--since", NOW) == when.timestamp()


@pytest.mark.parametrize("text", ["", "soon", "3 fortnights", "2026-13-01", "-3d", "3", "1" * 400 + "d", "0000-01-01"])
def test_an_invalid_time_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match=r"^--since = .*: write a date such as "):
        moment(text, "--since", NOW)


def conoid(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture
def made(server: LocalServer, quiet_home: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Ids of three finished runs by name; the address of their server is in the environment."""
    monkeypatch.setenv("CONOID_URL", server.session.url)
    monkeypatch.setenv("CONOID_TOKEN", server.token)
    found = {}
    for name, speed in (("slow", 100), ("fast", 300), ("other", 300)):
        path = case_file(quiet_home, steps=1)
        text = path.read_text().replace('name = "', f'name = "{name}_', 1)
        run = server.session.submit(
            _written(quiet_home / f"{name}.toml", text), [f"run.samples={speed}"], labels={"of": name}
        )
        run.wait()
        found[name] = run.id
    return found


def _written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def test_runs_are_found_by_case_label_state_words_and_date(server: LocalServer, made: dict[str, str]) -> None:
    def found(*words: str) -> set[str]:
        listed = conoid("runs", *words, "--json", "--limit", 50)
        assert listed.exit_code == 0, listed.output
        return {name for name, run in made.items() if run in listed.stdout}

    assert found() == set(made)
    assert found("--case", "slow_*") == {"slow"}
    assert found("--label", "of=fast") == {"fast"}
    assert found("of=other", "succeeded") == {"other"}
    assert found("--state", "failed") == set()
    assert found("--since", "1h", "--until", "2999-01-01") == set(made)
    assert found("--since", "2999-01-01") == set()
    assert conoid("runs", "no", "such", "words").stdout == "no run matches\n"
    wrong = conoid("runs", "--since", "soon")
    assert (wrong.exit_code, wrong.stderr[:24]) == (2, "conoid: --since = 'soon'")
    rows = {row.info.id: row for row in server.session.table(text="of=")}
    assert [rows[made[name]].values["run.samples"] for name in ("slow", "fast")] == [100, 300]
    assert rows[made["fast"]].results["steps"] == 1
    assert [info.id for info in server.session.runs(case="fast_*")][:1] == [made["fast"]]
    shown = conoid("runs", "--label", "of=slow").stdout
    assert rows[made["slow"]].info.short in shown
    assert made["slow"] not in shown


COMMANDS = (
    ("show",), ("watch", "--plain"), ("get", "outcome.json", "--out", "here"), ("checkpoint",), ("snapshot",),
    ("cancel",), ("restart",),
    ("figures", "energy"),
)  # fmt: skip


def test_every_command_takes_the_short_id(server: LocalServer, made: dict[str, str]) -> None:
    """Each command ends with a short id in the same way as with the full id."""
    (short,) = [row.info.short for row in server.session.table(text=made["slow"])]
    assert 7 <= len(short) < 22
    for command, *more in COMMANDS:
        before = [command, *more] if command == "figures" else [command]
        after = [] if command == "figures" else more
        brief, whole = (conoid(*before, run, *after) for run in (short, made["slow"]))
        assert "there is none" not in brief.output, command
        assert brief.exit_code == whole.exit_code, command
    assert (
        conoid("compare", short, made["fast"][:21]).exit_code == conoid("compare", made["slow"], made["fast"]).exit_code
    )


def test_an_ambiguous_prefix_is_reported(made: dict[str, str]) -> None:
    common = made["slow"][:2]
    done = conoid("show", common)
    assert done.exit_code == 2
    assert f"run = '{common}': several ids have this beginning: " in done.stderr
