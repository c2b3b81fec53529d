"""The table of runs and the page of a sweep, in node, as far as the table and the page need no browser."""

import json
import random
from typing import Any

import pytest

from conoid.cases.reference.flat import Scalar
from conoid.server.answers import card, rows

from .node import NODE, Ask

pytestmark = pytest.mark.skipif(NODE is None, reason="no node on this machine")

SPEED, SIZE = "parts[0].velocity[2]", "parts[0].mesh.element_size"
TABLE = """
    const table = new page.RunTable();
    table.take(data);
    const all = [...table.rows.values()];
"""


def line(run: str, n: int = 0, **more: Any) -> dict[str, Any]:
    """Returns one run of a list of runs."""
    found: dict[str, Any] = {
        "id": run, "short": run[:7], "name": "bar", "title": "A bar", "state": "succeeded", "cause": None,
        "message": "", "reason": "", "ranks": 1, "threads": 1, "submitted": 1000.0 + n,
        "started": 1001.0 + n, "finished": 1003.0 + n, "labels": {}, "progress": None,
    }  # fmt: skip
    return {**found, **more}


def answer(*runs: tuple[dict[str, Any], card.Card]) -> dict[str, Any]:
    """Returns the answer of the server with the given runs."""
    made = rows.Table()
    for run, known in runs:
        assert made.add(run, known)
    listed = [json.loads(bytes(row)) for row in made.rows]
    return {"runs": listed, "cases": [group.shown() for group in made.groups], "pending": 0, "next": None}


def asked(ask: Ask, module: str, script: str, data: Any) -> Any:
    return ask(module, f"(() => {{ {script} }})()", data)


def _line_of(n: int) -> dict[str, Any]:
    labels = {"sweep": "s", "point": str(n)} if n < 3 else {"batch": "first"}
    ended = {"state": "failed", "message": "it broke"} if n == 1 else {}
    return line(f"run{n}", n, labels=labels, **ended)


def _card_of(n: int) -> card.Card:
    values: dict[str, Scalar] = {
        SPEED: -100.0 * n,
        SIZE: 0.002 if n % 2 else 0.004,
        "parts[0].name": "bar",
        **{f"parts[0].velocity[{i}]": 0.0 for i in (0, 1)},
        **{f"k{i}": i for i in range(20)},
    }
    results = {"probe.speed": None if n == 4 else 10.0 - n, "fragments": 3.0 * n, "cpu": 5.0}
    units = {"probe.speed": "m/s", "cpu": "s"}
    return card.Card(values=values, results=results, units=units, references=2, missed=["extent"] if n == 2 else [])


@pytest.fixture(scope="module")
def some() -> dict[str, Any]:
    """Returns five runs of one case with different speeds and sizes, and a run of another case."""
    bars = [(_line_of(n), _card_of(n)) for n in range(5)]
    other = (line("other", 9, name="plate"), card.Card(values={f"q{i}": i for i in range(9)}, results={}))
    return answer(*bars, other)


def test_values_and_results_of_a_run_are_those_that_the_server_has(ask: Ask, some: dict[str, Any]) -> None:
    pair = f"[page.valueOf(row, '{SPEED}'), row.results.get('fragments') ?? null]"
    script = f"{TABLE} return all.map((row) => {pair});"
    assert asked(ask, "runtable.js", script, some) == [[-100 * n, 3 * n] for n in range(5)] + [[None, None]]


def test_columns_are_the_keys_that_differ_within_cases_that_are_alike(ask: Ask, some: dict[str, Any]) -> None:
    some_of_them = "all.filter(({ id }) => id === 'run1' || id === 'run3')"
    script = f"{TABLE} return [page.differing(all, 9), page.differing({some_of_them}, 9)];"
    found = asked(ask, "runtable.js", script, some)
    assert set(found[0]) == {SPEED, SIZE}
    assert found[1] == [SPEED]


def test_keys_that_few_runs_change_or_that_follow_another_are_not_shown_at_first(ask: Ask) -> None:
    speeds = {n: {f"parts[{i}].velocity[2]": -100.0 * n for i in (0, 1)} for n in range(40)}
    cards = [card.Card(values={**speeds[n], "mesh": n % 2, "limit": int(n == 7)}, results={}) for n in range(40)]
    rows = answer(*((line(f"run{n:02}", n), one) for n, one in enumerate(cards)))
    script = f"{TABLE} const keys = page.differing(all, 9); return [keys, [...page.prominent(all, keys)]];"
    keys, first = asked(ask, "runtable.js", script, rows)
    assert (set(keys), keys[-1]) == ({*speeds[0], "mesh", "limit"}, "limit")
    assert first == [keys[0], "mesh"]


def test_titles_of_keys_have_the_names_of_parts_and_axes(ask: Ask) -> None:
    """A part that has another name in another case has its number in the titles of its columns. Two keys never have the
    same title.
    """
    vector = {f"parts[0].velocity[{i}]": 0.0 for i in range(3)}
    one = {**vector, "parts[0].name": "ball", "parts[1].name": "plate", "parts[1].mesh.element_size": 1e-3}
    more = {"run.end_time": 1.0, "numerics.dt_safety": 0.9, "materials.steel.strength.A": 1e9, "parts[1].size": 1.0}
    keys = [SPEED, "parts[1].mesh.element_size", *more, "parts[1].mesh.size", "q[0]"]
    base = {**one, **more, "parts[1].mesh.size": 1, "q[0]": 1}
    rows = [keys, [{"base": base}], [{"base": base}, {"base": {**base, "parts[0].name": "rod"}}]]
    script = "data.slice(1).map((list) => [...page.titles(data[0], list).values()])"
    alone, mixed = ask("titles.js", script, rows)
    assert alone[:2] == ["ball velocity z", "plate element size"]
    assert alone[2:] == ["end time", "dt safety", "steel strength A", "parts[1].size", "parts[1].mesh.size", "q 1"]
    assert mixed == ["part 1 velocity z", *alone[1:]]


def test_a_second_answer_changes_its_rows_and_drops_removed_runs(ask: Ask, some: dict[str, Any]) -> None:
    script = f"""{TABLE}
        const same = table.take(data);
        const after = table.take({{ ...data, runs: [{{ ...data.runs[0], state: "lost" }}] }});
        table.keepOnly(data.runs.slice(1), true);
        return [same, after, table.rows.size, table.rows.has("run0")];"""
    assert asked(ask, "runtable.js", script, some) == [False, True, 5, False]


MODULES = "columns.js runtable.js sorting.js response.js"
COLUMNS = """
    const { RunTable, differing } = page;
    const table = new RunTable();
    table.take(data);
    const all = [...table.rows.values()];
    const columns = page.columnsOf(all, differing(all, 9), table.units);
    const by = (id) => columns.find((one) => one.id === id);
"""


def test_a_column_has_one_unit_and_short_names_that_are_clear(ask: Ask, some: dict[str, Any]) -> None:
    script = f"""{COLUMNS}
        const size = by("value:{SIZE}");
        const speed = by("result:probe.speed");
        return [[size.title, size.unit, all.map(size.text)], [speed.unit, speed.title],
          columns.filter(({{ shown }}) => shown).map(({{ id }}) => id)];"""
    size, speed, shown = ask(MODULES, f"(() => {{ {script} }})()", some)
    assert size == ["bar element size", "mm", ["4", "2", "4", "2", "4", ""]]
    assert speed == ["m/s", "speed"]
    assert shown[:2] == ["run", "state"]
    assert {"value:parts[0].velocity[2]", "result:probe.speed", "result:fragments", "references"} <= set(shown)
    assert "result:cpu" not in shown


def test_a_sweep_over_materials_differs_in_the_material(ask: Ask) -> None:
    """The constants of a material do not differ, because other cases lack this material. A column has only the first
    digits of a hash.
    """
    names = ["steel", "steel", "copper", "copper", "lead", "lead"]
    material, file = "parts[0].material", "parts[0].mesh.sha256"
    own: list[dict[str, Scalar]] = [{f"materials.{name}.{key}": 8e3 for key in ("density", "young")} for name in names]
    values: list[dict[str, Scalar]] = [
        {material: name, file: f"{n:08x}{'0' * 56}", **own[n]} for n, name in enumerate(names)
    ]
    same: dict[str, Scalar] = {f"k{i}": i for i in range(40)}
    made = [(line(f"run{n}", n), card.Card(values={**same, **one}, results={})) for n, one in enumerate(values)]
    script = (
        f"{COLUMNS} return [differing(all, 9), ['{material}', '{file}'].map((key) => by('value:' + key).text(all[2]))];"
    )
    keys, texts = ask(MODULES, f"(() => {{ {script} }})()", answer(*made))
    assert (keys, texts) == ([file, material], ["copper", "00000002"])


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("", {0, 1, 2, 3, 4, 9}), ("state:failed", {1}), ("it broke", {1}), ("BATCH=first", {3, 4}),
        ("case:plate", {9}), ("bar speed>8", {0, 1}), ("speed>=8 speed<9.5", {1, 2}), ("element_size=2", {1, 3}),
        ("velocity[2]<-250", {3, 4}), ("bar_velocity_z<-250", {3, 4}),
        ("run2", {2}), ("nothing", set()), ("run2 run3", set()), ("fragments=0", {0}), ("speed>x", set()),
    ],
)  # fmt: skip
def test_rows_are_filtered_by_words_and_numbers(ask: Ask, some: dict[str, Any], words: str, found: set[int]) -> None:
    script = f"""{COLUMNS}
        const {{ matcher }} = page;
        return all.filter(matcher({json.dumps(words)}, columns)).map(({{ submitted }}) => submitted - 1000);"""
    assert set(ask(MODULES, f"(() => {{ {script} }})()", some)) == found


def test_rows_are_sorted_by_any_column_and_what_has_no_value_comes_last(ask: Ask, some: dict[str, Any]) -> None:
    script = f"""{COLUMNS}
        const {{ sorted, grouped }} = page;
        const order = (id, down) => sorted(all, by(id), down).map((row) => row.id);
        const groups = grouped(all, "sweep").map(({{ key, rows }}) => [key, rows.length]);
        const speeds = [false, true].map((down) => order("result:probe.speed", down));
        return [...speeds, order("run", false)[0], order("submitted", true), groups];"""
    up, down, first, newest, groups = ask(MODULES, f"(() => {{ {script} }})()", some)
    assert up[:4] == ["run3", "run2", "run0", "run1"], "run1 has failed"
    assert set(up[4:]) == {"run4", "other"}
    assert down == ["run0", "run2", "run3", "run1", "run4", "other"]
    assert first.startswith("run")
    assert newest == ["other", "run4", "run3", "run2", "run1", "run0"]
    assert groups == [["s", 3], ["", 3]]


def test_short_ids_are_those_of_the_server(ask: Ask) -> None:
    draw = random.Random(7)
    ids = sorted({"".join(draw.choices("ab", k=22)) for _ in range(200)})
    assert ask("runtable.js", "Object.fromEntries(page.shorts(data))", ids) == rows.short(ids, 7)


def test_a_thousand_rows_are_sorted_in_a_moment(ask: Ask) -> None:
    """The test limits the CPU time of the whole table for 5,000 rows."""
    known = [
        (line(f"run{n:06d}", n), card.Card(values={"v": float(n % 97)}, results={"probe.x": float(n % 89)}))
        for n in range(5000)
    ]
    script = f"""{COLUMNS}
        const {{ sorted }} = page;
        const before = process.cpuUsage().user;
        const found = sorted(all, by("result:probe.x"), true);
        return [found.length, (process.cpuUsage().user - before) / 1e6];"""
    found, seconds = ask(MODULES, f"(() => {{ {script} }})()", answer(*known))
    assert found == 5000
    assert seconds < 0.5


def test_a_response_leaves_out_what_has_not_come_to_its_end(ask: Ask, some: dict[str, Any]) -> None:
    script = f"""{COLUMNS}
        const points = all.slice(0, 5).map((row, n) => ({{ n, row }}));
        const [v, size, speed] = ["value:{SPEED}", "value:{SIZE}", "result:probe.speed"].map(by);
        const {{ words, curves: made, at }} = page.curves(points, v, [size], speed);
        const lost = page.lost(points, {{ curves: made, at }});
        const map = page.matrix(points, size, v, speed);
        const results = columns.filter(({{ id }}) => id.startsWith("result:"));
        const cells = map.cells.map((row) => row.map(({{ value, points: here }}) => [value, here.length]));
        return [words, made.map(({{ name, data }}) => [name, data]), map.rows.map(({{ text }}) => text),
          map.columns.length, cells, page.telling(points, results).id, lost];"""
    words, made, down, across, cells, best, lost = ask(MODULES, f"(() => {{ {script} }})()", some)
    assert words is None
    assert made == [
        ["bar element size 4 mm", [[-200, 8, "run2"], [0, 10, "run0"]]],
        ["bar element size 2 mm", [[-300, 7, "run3"]]],
    ]
    assert (down, across) == (["2", "4"], 5)
    assert cells[0] == [[None, 0], [7, 1], [None, 0], [None, 1], [None, 0]]
    assert best == "result:probe.speed"
    ended = {run["id"]: run["state"] for run in some["runs"][:5] if run["state"] in {"failed", "cancelled", "lost"}}
    assert [(run, why.split(":")[0]) for _, _, run, why in lost] == list(ended.items())
    assert {foot for _, foot, _, _ in lost} <= {7}


def test_keys_that_go_together_are_one_axis(ask: Ask) -> None:
    script = """(() => {
        const key = (name) => ({ id: name, title: name, value: (row) => row[name], text: (row) => String(row[name]) });
        const points = data.map((row, n) => ({ n, row: { ...row, state: "succeeded" } }));
        const groups = page.together(points, ["fixed", "v", "w", "size", "word"].map(key));
        const drawn = page.curves(points, groups[0], groups.slice(1), key("y")).curves;
        return [groups.map(({ id, named, members }) => [id, named, members.length]),
          drawn.map(({ name, data }) => [name, data.length]),
          page.together(points, [key("fixed")]).map(({ id }) => id)];
    })()"""
    points = [
        {"id": f"{v}{size}", "fixed": 1, "v": v, "w": 9 - v, "word": f"law {v}", "size": size, "y": v * size}
        for v in (1, 2, 3) for size in (4, 5)
    ]  # fmt: skip
    groups, drawn, alone = ask("response.js", script, points)
    assert groups == [["v", "v and 2 more that go with it", 3], ["size", "size", 1]]
    assert drawn == [["size 4", 3], ["size 5", 3]]
    assert alone == ["fixed"]


def test_a_key_of_words_has_places_on_the_axis(ask: Ask) -> None:
    script = """
        const column = { title: "form", value: (row) => row.form, text: (row) => row.form };
        const result = { title: "y", value: (row) => row.y };
        return page.curves(data.map((row, n) => ({ n, row: { ...row, state: "succeeded" } })), column, [], result);"""
    points = [{"id": "a", "form": "split", "y": 2.0}, {"id": "b", "form": "nodal", "y": 1.0}]
    found = asked(ask, "response.js", script, points)
    assert found == {"words": ["split", "nodal"], "curves": [{"name": "", "data": [[0, 2, "a"], [1, 1, "b"]]}]}
