"""The table of runs is bounded, paged, and limited to the user's own runs; results are read once."""

import json
import random
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec
import pytest

from conoid.cases import outcome
from conoid.cases.output import layout
from conoid.cases.run import State
from conoid.server.answers import card, cards, rows
from conoid.server.answers.filters import Chosen
from conoid.server.database.store import Store
from conoid.server.runs import folder
from conoid.server.runs.events import Run

from .running import TOML, Running, User, case_text
from .sweep_bodies import handed_in, wish

CHOICES: tuple[bool | float | str, ...] = (1.0, 2.0, "a", True)


def table(user: User, **query: Any) -> dict[str, Any]:
    answer = user.http.get("/v1/table", params=query)
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def value(answer: dict[str, Any], run: dict[str, Any], key: str) -> Any:
    """Returns a value of the case of a run."""
    return run["values"].get(key, answer["cases"][run["case"]]["values"].get(key))


def result(answer: dict[str, Any], run: dict[str, Any], name: str) -> Any:
    names = [each["name"] for each in answer["cases"][run["case"]]["results"]]
    return run["results"][names.index(name)]


def test_the_table_has_values_and_results_of_the_runs_of_one_user(server: Running, tmp_path: Path) -> None:
    ended = [server.ann.submit(steps=n, end_time=f"{n} us") for n in (1, 2)]
    for run in ended:
        server.ann.wait_for(run)
    live = server.ann.submit(wait=str(tmp_path / "go"), end_time="3 us")
    server.ann.wait_for(live, State.RUNNING)
    server.bob.submit(name="secret")
    answer = table(server.ann)
    assert [run["id"] for run in answer["runs"]] == [live, *ended[::-1]]
    assert [value(answer, run, "run.end_time") for run in answer["runs"]] == [3e-6, 2e-6, 1e-6]
    assert len(answer["cases"]) == 1
    assert answer["cases"][0]["units"]["run.end_time"] == "s"
    assert [run["results"] and result(answer, run, "steps") for run in answer["runs"]] == [None, 2, 1]
    assert all(run["title"] == "A bar" and run["id"].startswith(run["short"]) for run in answer["runs"])
    assert "secret" not in json.dumps(answer)
    assert [run["name"] for run in table(server.bob)["runs"]] == ["secret"]
    (tmp_path / "go").touch()
    server.ann.wait_for(live)
    again = table(server.ann)
    assert result(again, again["runs"][0], "steps") == 3


def test_the_files_are_read_once_and_an_index_that_is_lost_is_made_again(
    server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = server.ann.submit(steps=1)
    server.ann.wait_for(run)
    first = table(server.ann)
    (server.ann.runs / run / layout.OUTCOME).unlink()
    (server.ann.runs / run / layout.RESOLVED_CASE).unlink()
    assert table(server.ann) == first
    monkeypatch.setattr(card, "FORM", card.FORM + 1)
    made_again = table(server.ann)["runs"][0]
    assert (made_again["values"], made_again["results"], made_again["title"]) == ({}, [], "A bar")


def test_results_left_out_by_the_time_limit_come_with_the_next_answer(
    server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    server.ann.wait_for(server.ann.submit(steps=1))
    monkeypatch.setattr(cards, "_PATIENCE", 0.0)
    answer = table(server.ann)
    assert (answer["pending"], answer["runs"][0]["results"]) == (1, None)
    monkeypatch.setattr(cards, "_PATIENCE", 10.0)
    answer = table(server.ann)
    assert (answer["pending"], result(answer, answer["runs"][0], "steps")) == (0, 1)


def test_pages_are_whole_and_none_is_larger_than_is_allowed(server: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    runs = [server.ann.submit(steps=1) for _ in range(5)]
    for run in runs:
        server.ann.wait_for(run)
    for most, limit, sizes in ((rows.MOST_BYTES, 2, [2, 2, 1]), (1, 500, [1] * 5), (rows.MOST_BYTES, 5, [5])):
        monkeypatch.setattr(rows, "MOST_BYTES", most)
        seen, sizes_seen = list[str](), list[int]()
        query: dict[str, Any] = {"limit": limit}
        while True:
            answer = table(server.ann, **query)
            seen += [run["id"] for run in answer["runs"]]
            sizes_seen.append(len(answer["runs"]))
            if answer["next"] is None:
                break
            query["cursor"] = answer["next"]
        assert (seen, sizes_seen) == (runs[::-1], sizes)
    assert server.ann.http.get("/v1/table", params={"limit": 501}).status_code == 400


def test_cases_that_are_like_no_other_count_for_the_size_of_an_answer() -> None:
    sizes = []
    for begin in range(0, 500, 100):
        made, n = rows.Table(), begin
        while n < 500 and made.add({"id": str(n)}, card.Card(values={f"key{n}.{k}": "x" * 200 for k in range(1000)})):
            n += 1
        body = msgspec.json.encode({"runs": made.rows, "cases": [group.shown() for group in made.groups]})
        sizes.append(len(body))
        assert n > begin
        assert len(made.groups) == n - begin
    assert max(sizes) < 2 * rows.MOST_BYTES


def test_a_removed_run_is_in_no_table(server: Running) -> None:
    kept, gone = (server.ann.submit(steps=1) for _ in range(2))
    for run in (kept, gone):
        server.ann.wait_for(run)
    shutil.rmtree(server.ann.runs / gone)
    server.ann.http.get(f"/v1/runs/{gone}")
    assert [run["id"] for run in table(server.ann)["runs"]] == [kept]


def test_damaged_files_make_a_poor_row_and_no_error(server: Running) -> None:
    run = server.ann.submit(steps=1)
    server.ann.wait_for(run)
    for name in (layout.OUTCOME, layout.RESOLVED_CASE, layout.SUBMISSION):
        (server.ann.runs / run / name).write_bytes(b"\xff[" * 500)
    row = table(server.ann)["runs"][0]
    assert (row["id"], row["results"], row["values"], row["state"]) == (run, [], {}, "succeeded")


def test_only_changed_values_are_sent(server: Running, tmp_path: Path) -> None:
    old, live = server.ann.submit(steps=1), server.ann.submit(wait=str(tmp_path / "go"))
    at = server.ann.wait_for(old)["finished"]
    server.ann.wait_for(live, State.RUNNING)
    assert [run["id"] for run in table(server.ann, changed=at + 1e-3)["runs"]] == [live]
    (tmp_path / "go").touch()
    end = server.ann.wait_for(live)["finished"]
    assert [run["id"] for run in table(server.ann, changed=end)["runs"]] == [live]
    assert table(server.ann, changed=end + 1e-3)["runs"] == []
    known = server.ann.http.get("/v1/table").headers["ETag"]
    assert server.ann.http.get("/v1/table", headers={"If-None-Match": known}).status_code == 304


def test_runs_are_chosen_by_case_words_and_time(server: Running) -> None:
    names = ("steel_100", "steel_200", "glass%")
    runs = {}
    for name in names:
        answer = server.ann.http.post(
            "/v1/runs",
            params={"label": f"of={name[:5]}"},
            content=case_text(name.replace("%", "_"), steps=1),
            headers=TOML,
        )
        runs[name] = str(answer.json()["id"])
        server.ann.wait_for(runs[name])

    def found(**query: Any) -> set[str]:
        reported = [
            {run["id"] for run in server.ann.http.get(path, params=query).json()["runs"]}
            for path in ("/v1/runs", "/v1/table")
        ]
        assert reported[0] == reported[1]
        return {name for name, run in runs.items() if run in reported[0]}

    assert found(case="steel_100") == {"steel_100"}
    assert found(case="STEEL*") == {"steel_100", "steel_200"}
    assert found(case="steel") == set()
    assert found(case="%") == set()
    assert found(text="steel 200") == {"steel_200"}
    assert found(text="of=glass") == {"glass%"}
    assert found(text="succeeded a bar") == set(names)
    assert found(text="100%") == set()
    assert found(text=runs["steel_100"]) == {"steel_100"}
    middle = server.ann.show(runs["steel_200"])["submitted"]
    assert found(since=middle) == {"steel_200", "glass%"}
    assert found(until=middle) == {"steel_100"}
    assert found(text="steel", since=middle, state="succeeded") == {"steel_200"}
    assert server.ann.http.get("/v1/table", params={"text": "x " * 9}).status_code == 400


def test_a_sweep_is_found_by_its_label(server: Running) -> None:
    sweep = handed_in(server.ann, wish())
    for point in sweep["points"]:
        server.ann.wait_for(point["run"]["id"])
    answer = table(server.ann, label=f"sweep={sweep['id']}")
    assert [value(answer, run, "run.end_time") for run in answer["runs"]] == [4e-6, 3e-6, 2e-6, 1e-6]
    assert {run["labels"]["sweep"] for run in answer["runs"]} == {sweep["id"]}
    assert len({run["short"] for run in answer["runs"]}) == 4


# Without a server -----------------------------------------------------------------------------------------------------


def test_a_short_id_is_the_shortest_beginning_that_no_other_has() -> None:
    draw = random.Random(3)
    ids = sorted({"".join(draw.choices("01", k=22)) for _ in range(300)})
    for each, brief in rows.short(ids, 7).items():
        assert [one for one in ids if one.startswith(brief)] == [each]
        assert len(brief) == 7 or len([one for one in ids if one.startswith(brief[:-1])]) > 1
    assert rows.short(["abcdefghij"], 7) == {"abcdefghij": "abcdefg"}


def test_values_are_restored_for_any_common_keys() -> None:
    draw = random.Random(5)
    keys = [f"parts[{n}].velocity" for n in range(40)]
    cases: list[dict[str, bool | int | float | str]] = [
        {key: draw.choice(CHOICES) for key in keys if draw.random() < share}
        for share in (1, 0.95, 0.9, 0.1, 0.5)
        for _ in range(8)
    ]
    made = rows.Table()
    for n, values in enumerate(cases):
        assert made.add({"id": n}, card.Card(values=values, results={"x": float(n)}, units={"x": "m"}))
    groups = [group.shown() for group in made.groups]
    for values, row in zip(cases, map(msgspec.json.decode, made.rows), strict=True):
        found = {**groups[row["case"]]["values"], **row["values"]}
        assert {key: each for key, each in found.items() if each is not None} == values
    assert 1 < len(groups) < len(cases)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    made = Store(f"sqlite:///{tmp_path / 'server.sqlite'}")
    yield made
    made.close()


def laid(runs: Path, store: Store, owners: Sequence[str]) -> list[Run]:
    """Makes finished runs, each in a folder with a small case."""
    found = []
    for n, owner in enumerate(owners):
        run_id, now = folder.new_id()
        made = folder.Submission(
            id=run_id, owner=owner, name="bar", title=f"Bar {n}", ranks=1, submitted=now, case_file="case.toml",
            body_sha256="", idempotency_key=None, wall_time=None, estimate={},
        )  # fmt: skip
        path = folder.create(runs, made, b"", json.dumps({"parts": [{"velocity": [0.0, 0.0, float(n)]}]}).encode())
        ended = outcome.Outcome(state="succeeded", steps=n)
        (path / layout.OUTCOME).write_bytes(outcome.to_json(ended))
        found.append(Run(run_id, owner, "bar", 1, now, State.SUCCEEDED, finished=now))
        store.add(found[-1], None)
    return found


def test_a_database_of_an_earlier_server_gets_titles(tmp_path: Path, store: Store) -> None:
    made = laid(tmp_path, store, ["ann", "bob"])
    assert store.page("ann", Chosen(words=["bar", "0"]), None, 9) == []
    found = cards.Cards(tmp_path, store).of(made[:1])
    assert found[made[0].id].values == {
        "parts[0].velocity[0]": 0.0,
        "parts[0].velocity[1]": 0.0,
        "parts[0].velocity[2]": 0.0,
    }
    assert [run.id for run in store.page("ann", Chosen(words=["bar", "0"]), None, 9)] == [made[0].id]
    assert store.ids_about("ann", made[0].id, made[0].id) == [made[0].id]
