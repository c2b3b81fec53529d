"""Functions of the page that need no browser, in node: snapshots, fits, groups of phases, keys that differ."""

import base64
import gzip
import itertools
import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from conoid.cases.load import parse_case
from conoid.cases.output import fragments
from conoid.client.drawing import part_colours, scales
from conoid.client.drawing.fields import FIELDS
from conoid.client.snapshots import Snapshot
from conoid.worker.snapshots import blob

from ..snapshots.shattered import shattered
from .node import NODE, Ask

HERE = Path(__file__)
WEB = HERE.parents[2] / "client" / "web"
pytestmark = pytest.mark.skipif(NODE is None, reason="no node on this machine")


def test_parts_and_fragments_have_the_colours_of_pictures(ask: Ask) -> None:
    random = np.random.default_rng(3)
    numbers = [-1, 0, 1, 2, 3, 7, 8, 9, 100, 12_690, 10**6, *random.integers(0, 2**40, 500).tolist()]
    parts = random.integers(0, 30, len(numbers)).tolist()
    script = "data[0].map((id, i) => page.ofFragment(BigInt(id), data[1][i], 3))"
    assert ask("colours.js", script, [numbers, parts]) == part_colours.of_fragments(numbers, parts, 3).tolist()
    assert ask("colours.js", "data.map(page.ofName)", parts) == part_colours.of_names(parts).tolist()


@pytest.fixture(scope="module")
def made() -> bytes:
    head = {"n": 7, "step": 1200, "t": 2.5e-5, "ranks": 2}
    return blob.made(shattered(5, 40).whole(2), head, lambda labels: np.asarray(1e-6 * labels), blob.Budget()).data


def sent(data: bytes) -> dict[str, str]:
    return {"base64": base64.b64encode(data).decode()}


def test_a_snapshot_is_read_as_python_reads_it(ask: Ask, made: bytes) -> None:
    found, known = ask("snapshot.js", "page.decode(data)", sent(made)), Snapshot(made)
    assert found["header"]["step"] == 1200
    assert set(found["arrays"]) == set(known.header.arrays)
    for name, values in found["arrays"].items():
        assert np.array_equal(values, known.array(name).ravel()), name


@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (lambda data: b"NOTASNAP" + data[8:], "not a snapshot"),
        (lambda data: data[:8] + b"\2" + data[9:], "of version 2"),
        (lambda data: data[:-64], "length"),
    ],
)
def test_an_invalid_snapshot_is_refused(ask: Ask, made: bytes, harm: Callable[[bytes], bytes], words: str) -> None:
    script = "(() => { try { page.decode(data); } catch (error) { return error.message; } })()"
    assert words in ask("snapshot.js", script, sent(harm(made)))


def test_every_corner_has_its_place_its_fragment_and_its_value(ask: Ask, made: bytes) -> None:
    known = Snapshot(made)
    triangles = known.array("triangles").ravel()
    corners = np.array(ask("snapshot.js", "page.corners(page.decode(data).arrays)", sent(made))).reshape(-1, 4)
    assert np.array_equal(corners[:, :3], known.array("positions")[triangles])
    assert np.array_equal(corners[:, 3], known.array("vertex_fragment")[triangles])
    for by, name in (("rank", "triangle_rank"), ("part", "triangle_part"), ("speed", "field:speed")):
        values = ask("snapshot.js", f"page.cornerValues(page.decode(data), '{by}')", sent(made))
        assert np.array_equal(values, np.repeat(known.array(name), 3))


def test_a_picked_fragment_is_its_row(ask: Ask, made: bytes) -> None:
    table = Snapshot(made).fragments
    row = len(table["id"]) // 2
    found = ask("snapshot.js", f"page.fragment(page.decode(data), {row})", sent(made))
    assert (found["id"], found["tets"], found["rest"]) == (table["id"][row], table["tets"][row], False)
    assert (found["mass"], found["birth"]) == (table["mass"][row], pytest.approx(table["birth"][row]))
    assert found["velocity"] == pytest.approx(table["velocity"][row])
    place = f"page.rowOf(page.decode(data), {table['id'][row]}n)"
    assert ask("snapshot.js", place, sent(made)) == row


def test_sizes_and_laws_are_those_of_the_tables(ask: Ask, made: bytes) -> None:
    table = Snapshot(made).fragments
    whole = sorted(map(float, table["size"][table["tets"] >= fragments.DUST]))
    found = ask("snapshot.js", "page.sizes(page.decode(data))", sent(made))
    assert found["points"] == [[size, len(whole) - i] for i, size in enumerate(whole)]
    laws = ask("snapshot.js", "page.laws(data)", whole)
    for one, fit in zip(laws, fragments.fits(whole), strict=True):
        assert one["law"] == fit.law
        assert one["parameter"] == pytest.approx(fit.parameter)
        assert math.isclose(one["likelihood"], fit.log_likelihood, rel_tol=1e-9)


def test_waiting_is_distinguished_from_being_descheduled(ask: Ask) -> None:
    load = {"phases": {"elements": [1.0, 0.5], "exchange": [0.5, 1.0]}, "waiting": [0.25, 0.875]}
    assert ask("live.js", "page.grouped(data, 2)", load) == {
        "compute": [1.0, 0.5], "exchange": [0.25, 0.125], "waiting": [0.25, 0.875], "descheduled": [0.5, 0.5],
    }  # fmt: skip


def test_the_other_threads_of_a_rank_are_busy_by_the_time_of_their_tasks(ask: Ask) -> None:
    first = {"type": "load", "seq": 1, "wall": 4.0, "t": 0.0, "imbalance": 1.0, "phases": {"elements": [1.0]}}
    loads = [first, {**first, "seq": 2, "wall": 6.0, "threads": 3, "helped": [1.0]}]
    script = (
        "(() => { const live = new page.Live('r'); data.forEach((m) => live.take(m)); return live.load.helped; })()"
    )
    assert ask("live.js", script, loads) == [0.25]
    assert ask("live.js", script, [first, {**first, "seq": 2, "wall": 6.0}]) == []


def test_a_long_series_is_thinned_and_keeps_its_ends(ask: Ask) -> None:
    script = """(() => {
      const live = new page.Live("r");
      const tell = (seq, t) => live.take({ type: "counts", seq, wall: 1, t, nodes: seq, facets: 0, fragments: 1 });
      for (let i = 1; i <= 9000; i += 1) tell(i, i);
      tell(9000, -1);
      return live.sizes.map(({ t }) => t);
    })()"""
    times = ask("live.js", script)
    assert (times[0], times[-1]) == (1, 9000)
    assert times == sorted(times)
    assert 1000 <= len(times) <= 2000


def test_keys_that_differ_are_named_by_their_place(ask: Ask) -> None:
    one = {"name": "a", "parts": [{"name": "bar", "v": [0, 0, 1]}], "run": {"ranks": 1, "frames": None}, "list": [1, 2]}
    other = {"name": "b", "parts": [{"name": "bar", "v": [0, 0, 2]}], "run": {"ranks": 1, "seed": None}, "list": [1]}
    assert ask("differences.js", "page.differences(data)", [one, other, {**one, "new": True}]) == [
        ["parts[0].v[2]", 1, 2, 1], ["list[1]", 2, None, 2], ["new", None, None, True],
    ]  # fmt: skip
    script = "data[1].map((key) => page.about(key, data[0]))"
    keys = ["parts[0].v[2]", "list[1]", "run.ranks", "materials.mild_steel.A"]
    assert ask("differences.js", script, [one, keys]) == ["bar v z", "list 1", "ranks", "mild steel A"]


def test_runs_are_named_by_the_keys_that_differ(ask: Ask) -> None:
    def named(names: list[str], differing: list[list[Any]]) -> list[str]:
        ids = [f"1k1f9cbqje{k:02d}" for k in range(len(names))]
        plan = {"parts": [{"name": "bar", "v": [0, 0, 1]}]}
        runs = [{"info": {"name": name, "id": id_}, "plan": plan} for name, id_ in zip(names, ids, strict=True)]
        script = "page.called(data[0], data[1], { 'parts[0].v[2]': 'm/s' })"
        found: list[str] = ask("differences.js", script, [runs, differing])
        return found

    keys = [["parts[0].v[2]", 1, 2500]]
    assert named(["bar", "ball"], keys) == ["bar", "ball"]
    assert named(["bar", "bar"], keys) == ["bar v z 1 m/s", "bar v z 2.5 km/s"]
    assert named(["bar", "bar"], []) == ["1k1f9cbqje00", "1k1f9cbqje01"]
    assert named(["bar", "bar"], [["seed", 1, 1]]) == ["seed 1 (1k1f9cbqje00)", "seed 1 (1k1f9cbqje01)"]
    assert named(["a", "a", "b"], [["x", 1, 2, 3]]) == ["a, x 1", "a, x 2", "b"]


def test_a_column_of_results_has_one_unit(ask: Ask) -> None:
    def run(push: float | None, passed: bool) -> dict[str, Any]:
        extremes = {} if push is None else {"push": {"unit": "N", "last": push, "least": -push, "most": 2 * push}}
        outcome = {"reference": [{"name": "speed", "value": 1e-3, "unit": "m/s", "pass": passed}], "fragments": 1200}
        plan = {"probes": [{"name": "push"}]}
        return {"info": {"outcome": outcome}, "plan": plan, "columns": {"units": {"push": "N"}, "extremes": extremes}}

    script = "page.results(data, 'most').map(({ title, unit, values, text }) => [title, unit, values.map(text)])"
    assert ask("differences.js", script, [run(3.0, True), run(2e3, False), run(None, True)]) == [
        ["push", "kN", ["0.006", "4", "–"]], ["speed (reference)", "mm/s", ["1", "1", "1"]],
        ["references met", "", ["100 %", "0 %", "100 %"]], ["fragments", "", ["1\u202f200"] * 3],
    ]  # fmt: skip


def test_what_is_drawn_is_a_table(ask: Ask) -> None:
    charts = [
        {"name": "a", "unit": "Pa", "data": [[0, 1.5], [2, None]]},
        {"name": "b, c", "data": [{"value": [1, 2]}, [2, 3]]}, {"name": "pins", "aside": True, "data": [[5, 5]]},
    ]  # fmt: skip
    table = ask("tables.js", "page.tableOf({ series: data })", charts)
    assert table == {"head": ["t [s]", "a [Pa]", "b, c"], "rows": [[0, 1.5, None], [1, None, 2], [2, None, 3]]}
    csv = ask("tables.js", "page.toCsv(data.head, data.rows)", table)
    assert csv == 't [s],a [Pa],"b, c"\n0,1.5,\n1,,2\n2,,3\n'


def test_columns_are_picked_from_a_history_as_they_stand(ask: Ask) -> None:
    text = 'step,t [s],limiter,kinetic [J],push [N]\r\n0,0.0,"a, ""b""",1.25e-07,3.0\r\n1,1e-9,c,nan,4.0\r\n2,2e'
    assert ask("tables.js", "page.pick(data, ['push', 'kinetic', 'none'])", text) == {
        "head": ["t [s]", "push [N]", "kinetic [J]"], "rows": [["0.0", "3.0", "1.25e-07"], ["1e-9", "4.0", "nan"]],
    }  # fmt: skip


def test_work_of_ranks_fills_time_without_gaps_however_uneven_reports_are(ask: Ask) -> None:
    few = [{"t": t, "shares": [1.0, 0.5]} for t in (1.0, 1.5, 4.0)]
    assert ask("loads.js", "page.cells(data, 2, 4).filter(({ row }) => row === 1)", few) == [
        {"from": a, "to": b, "row": 1, "share": 0.5} for a, b in ((0, 1), (1, 1.5), (1.5, 4))
    ]  # fmt: skip
    many = [{"t": k**2 / 1e4, "shares": [k % 2] * 200} for k in range(1, 1001)]
    found = ask("loads.js", "page.cells(data, 200, 100)", many)
    row = [one for one in found if one["row"] == 3]
    assert len(row) <= 240
    assert [one["to"] for one in row[:-1]] == [one["from"] for one in row[1:]]
    assert (row[0]["from"], row[-1]["to"]) == (0, 100)
    assert max(one["row"] for one in found) == 63
    names = "[0, 63].map((row) => page.rowName(row, 200))"
    assert ask("loads.js", names) == ["ranks 0 to 3", "ranks 197 to 199"]


LIVE = """(() => {
    const live = new page.Live("r");
    live.plan = data.plan;
    live.columns = data.columns;
    data.messages.forEach((one, i) => live.take({ ...one, seq: i + 1 }));
    return live.columns.values;
})()"""


def test_probes_follow_the_stream_from_the_last_line_that_is_known(ask: Ask) -> None:
    values = {"t": [0, 1], "push": [0, 5], "kinetic": [9, 8], "kinetic.rod": [9, 8], "momentum_x": [0, 1]}
    columns = {"units": {"t": "s", "push": "N", "kinetic": "J"}, "lines": 2, "values": values}
    at = {"type": "progress", "t": 9, "dt": 1, "limiter": "", "energy": {"kinetic": 7}}
    parts = {"rod": {"kinetic": 6}}
    messages = [
        {**at, "sampled": 1, "probes": {"push": 5}}, {**at, "sampled": 3, "probes": {"push": None}, "parts": parts},
        {**at, "sampled": 3, "probes": {"push": None}}, {**at, "sampled": 4, "probes": {"push": 6}}, at,
    ]  # fmt: skip
    assert ask("live.js", LIVE, {"columns": columns, "messages": messages}) == {
        "t": [0, 1, 3, 4], "push": [0, 5, None, 6], "kinetic": [9, 8, 7, 7], "kinetic.rod": [9, 8, 6, None],
        "momentum_x": [0, 1, None, None],
    }  # fmt: skip


def test_the_box_beside_the_cursor_has_the_nearest_points_of_all_lines(ask: Ask) -> None:
    script = """page.worth(data.map((one) => ({ ...one, tooltip: { valueFormatter: (value) => `${value} J` } })), 2.6)
        .map(({ name, text }) => [name, text])"""
    lines = [
        {"name": "low", "data": [[0, 1], [2, 2], [3, 3]]}, {"name": "high", "data": [{"value": [1, 9]}]},
        {"name": "gap", "data": [[2.5, None]]}, {"name": "pins", "aside": True, "data": [[2.6, 5]]},
    ]  # fmt: skip
    assert ask("cursorbox.js", script, lines) == [["high", "9 J"], ["low", "3 J"]]
    stacked = [{"name": name, "stack": "s", "data": [[0, value]]} for name, value in (("below", 9), ("above", 1))]
    assert ask("cursorbox.js", script, stacked) == [["above", "1 J"], ["below", "9 J"]]


def test_forces_are_grouped_by_pairs_and_a_magnitude_needs_all_components(ask: Ask) -> None:
    def probe(name: str, field: str, **more: str) -> dict[str, str]:
        return {"name": name, "part": "glass", "field": field, **more}

    forces = [probe(f"push_{axis}", f"contact_force_{axis}", by="steel") for axis in "xyz"]
    plan = {"probes": [*forces, probe("stop", "wall_force_z", wall="floor"), probe("lost", "contact_force_x")]}
    values = {"t": [0, 1], "push_x": [0, 2], "push_y": [0, 3], "push_z": [1, 6], "stop": [0, 0]}
    live = {"plan": plan, "columns": {"values": values, "units": {}, "lines": 2}}
    assert ask("probes.js", "page.pushes(data)", live) == {
        "steel on glass": {axis: f"push_{axis}" for axis in "xyz"}, "wall floor on glass": {"z": "stop"},
    }  # fmt: skip


def test_the_page_writes_numbers_as_python_does(ask: Ask) -> None:
    table = json.loads((HERE.parents[1] / "figures.json").read_text(encoding="utf-8"))
    written = ask("figures.js", "data.map(([name, given]) => page[name](...given))", table)
    assert json.loads(json.dumps(written, ensure_ascii=False).replace("\u202f", " ")) == [text for _, _, text in table]


def test_no_module_of_the_page_writes_numbers_on_its_own() -> None:
    """A width in a style sheet is excepted: users do not read this width."""
    own = re.compile(r"\.(toFixed|toExponential|toPrecision|toLocaleString)\(")
    found = [
        f"{path.name}: {line.strip()}"
        for path in WEB.glob("*.js")
        for line in path.read_text(encoding="utf-8").splitlines()
        if own.search(line) and path.name != "figures.js"
    ]
    assert not found


def test_energies_of_parts_are_equal_in_the_history_and_in_messages(ask: Ask) -> None:
    parts = {
        "rod": {"kinetic": [3.0, 2.0], "internal": [0.0, 1.5]},
        "ball": {"kinetic": [1.0, 1.0], "internal": [0.0, 0.5]},
    }
    history = {"series": {"t": [0.0, 1e-6], "dt": [1e-9] * 2}, "parts": parts, "last": 5}
    newest = {name: {"kinetic": 1.0, "internal": 2.0} for name in parts}
    message = {"type": "progress", "seq": 6, "t": 2e-6, "dt": 1e-9, "limiter": "", "energy": {}, "parts": newest}
    script = """(() => {
        const live = { ledger: [] };
        page.take(live, data.history);
        live.ledger.push(data.message);
        return live.ledger.map(({ parts }) => [parts.rod.kinetic, parts.ball.internal]);
    })()"""
    assert ask("history.js", script, {"history": history, "message": message}) == [[3.0, 0.0], [2.0, 0.5], [1.0, 2.0]]


def test_the_newest_fragments_of_any_source_are_shown(ask: Ask) -> None:
    counts = {"type": "counts", "t": 1e-6, "nodes": 9, "facets": 1, "smallest": -4, "sizes": [2, 1]}
    snapshot = {"type": "snapshot", "n": 0, "t": 2e-6, "step": 25, "fragments": 7, "smallest": -4, "sizes": [4, 2, 1]}
    sources = [
        {**counts, "step": 20, "counted": 18, "fragments": 3}, snapshot,
        {**counts, "step": 40, "counted": 18, "fragments": 3}, {**counts, "step": 50, "counted": 45, "fragments": 9},
    ]  # fmt: skip
    script = """data.map((message, at) => {
        const live = new page.Live("r");
        data.slice(0, at + 1).forEach((one, i) => live.take({ ...one, seq: i + 1 }));
        return [live.counts.fragments, live.spread.sizes.length];
    })"""
    assert ask("live.js", script, sources) == [[3, 2], [7, 3], [7, 3], [9, 2]]


def test_a_distribution_in_bins_is_summed_from_the_largest(ask: Ask) -> None:
    found = ask("plots.js", "page.longer(data)", {"smallest": -4, "sizes": [4, 0, 2, 1]})
    assert found == [[pytest.approx(2 ** (k / 2)), n] for k, n in zip(range(-4, 0), [7, 3, 3, 1], strict=True)]


def test_an_address_that_cannot_be_read_is_the_list(ask: Ask) -> None:
    found = {
        "": ["runs"], "#/": ["runs"], "#/runs": ["runs"], "#/runs/abc": ["run", "abc"], "#/runs/a%20b": ["run", "a b"],
        "#/compare/a/b": ["compare", "a", "b"], "#/compare/a/b/c/d": ["compare", "a", "b", "c", "d"],
        "#/sweeps/s": ["sweep", "s"], "#/new": ["new"], "#/new?from=abc": ["new"], "#/compare/a": ["runs"],
        "#/runs/%E0": ["runs"], "#/runs/%": ["runs"], "#/runs/%zz": ["runs"], "#/compare/a/%E0%A4%A": ["runs"],
        "#/runs/a/b": ["runs"], "#/toString/a": ["runs"], "#/constructor": ["runs"],
    }  # fmt: skip
    script = "data.map((hash) => { const { page: shown, names } = page.place(hash); return [shown, ...names]; })"
    assert ask("address.js", script, list(found)) == list(found.values())
    assert ask("address.js", "page.place('#/new?from=a%20b').query.get('from')") == "a b"


# Sections, frames and scales of the body ------------------------------------------------------------------------------


def test_a_section_has_the_area_the_places_and_the_values_of_the_tets_that_it_cuts(ask: Ask) -> None:
    body = shattered(4, 7)
    head = {"n": 0, "step": 0, "t": 0.0, "ranks": 1}
    made = blob.made(body.whole(1), head, lambda labels: np.zeros(len(labels)), blob.Budget())
    data = gzip.decompress(made.tets)
    known = Snapshot(data)
    tets = np.array(ask("section.js", "page.nodes(data)", known.array("tet_steps").ravel().tolist())).reshape(-1, 4)
    points = known.points
    volume = volumes(points[tets])
    assert np.abs(volume).sum() == pytest.approx(volumes(body.x[body.tets]).sum(), rel=1e-3)
    names = "positions", "tet_row", "field:plastic_strain"
    arrays = {name: known.array(name).ravel().tolist() for name in names}
    asked = {"header": {"box": known.header.box}, "tets": tets.ravel().tolist(), "arrays": arrays}
    for normal, at in (([1.0, 0.0, 0.0], 2.1e-3), ([0.0, -0.6, 0.8], 1e-4), ([0.577, 0.577, 0.577], 3.2e-3)):
        found = ask("section.js", f"page.cut(data, {normal}, {at})", asked)
        corner = np.array(found["corners"]).reshape(-1, 3, 4)
        low, high = np.array(known.header.box)
        places = low + corner[:, :, :3] / 65535.0 * (high - low)
        assert np.abs(places @ np.array(normal) - at).max() <= 2.0 * (high - low).max() / 65535.0
        assert np.array_equal(corner[:, 0, 3], known.array("tet_row")[found["tet"]])
        area = 0.5 * np.linalg.norm(np.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]), axis=1)
        assert area.sum() == pytest.approx(section_of(points[tets], np.array(normal), at), rel=1e-3)
        assert set(found["omit"]) <= {0, 1, 2}
        values = ask("section.js", "page.cutValues(data[0], data[1], 'plastic_strain')", [asked, found])
        assert np.array_equal(values, np.repeat(known.array("field:plastic_strain")[found["tet"]], 3))


def volumes(corners: np.ndarray) -> np.ndarray:
    return np.asarray(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0)


def section_of(corners: np.ndarray, normal: np.ndarray, at: float) -> float:
    """Returns the area in which a plane cuts tets (n, 4, 3), from the convex hulls of the points on their edges."""
    basis, total = np.linalg.svd(normal[None])[2][1:], 0.0
    for tet in corners:
        heights = tet @ normal - at
        pairs = [(i, j) for i, j in itertools.combinations(range(4), 2) if heights[i] * heights[j] < 0.0]
        if len(pairs) > 2:
            part = [heights[i] / (heights[i] - heights[j]) for i, j in pairs]
            points = [tet[i] + t * (tet[j] - tet[i]) for (i, j), t in zip(pairs, part, strict=True)]
            total += ConvexHull(np.array(points) @ basis.T, qhull_options="QJ").volume
    return total


def test_debris_does_not_make_the_frame_wider_and_heavy_pieces_do(ask: Ask) -> None:
    head = {"n": 0, "step": 0, "t": 0.0, "ranks": 1}

    def framed(mass: float) -> tuple[float, float]:
        """Returns the lengths along x of two frames, m: the frame around the bodies, and the frame around
        everything.
        """
        body = shattered(5, 1)
        far = np.argmax(body.x[body.tets].mean(axis=1)[:, 0])
        alone = replace(body, bond=body.bond.copy(), mass=body.mass.copy(), x=body.x.copy())
        nodes = np.unique(body.tets[far])
        x = np.vstack([body.x, body.x[nodes] + [1.0, 0.0, 0.0]])
        tets = body.tets.copy()
        tets[far] = len(body.x) + np.searchsorted(nodes, body.tets[far])
        across = body.across.copy()
        across[across // 4 == far] = -1
        across[far] = -1
        alone.mass[far] = mass
        alone = replace(alone, x=x, v=np.vstack([body.v, body.v[nodes]]), tets=tets, across=across)
        data = blob.made(alone.whole(1), head, lambda labels: np.zeros(len(labels)), blob.Budget()).data
        ends = []
        for options in ("{}", "{ all: true }"):
            points = np.array(ask("framing.js", f"page.points(data, {options})", decoded(ask, data))).reshape(-1, 3)
            ends.append(points[:, 0].max())
        return ends[0], ends[1]

    light, everything = framed(1e-9)
    assert light < 0.01 < 0.9 < everything
    assert framed(1.0)[0] > 0.9


def decoded(ask: Ask, data: bytes) -> Any:
    """Returns the table with fragment numbers in the type that node reads from JSON."""
    return ask("snapshot.js", "page.decode(data)", sent(data))


def test_a_camera_is_as_near_as_the_frame_allows(ask: Ask) -> None:
    random = np.random.default_rng(2)
    for _ in range(3):
        points, turn = random.normal(size=(40, 3)), np.linalg.qr(random.normal(size=(3, 3)))[0]
        axes = {"right": turn[0].tolist(), "up": turn[1].tolist(), "back": turn[2].tolist()}
        found = ask("framing.js", "page.stand(data[0], data[1], [0.5, 0.3], 0.2)", [points.ravel().tolist(), axes])
        x, y, z = (turn @ (points - found["place"]).T).tolist()
        seen = np.array([np.array(x) / -np.array(z), np.array(y) / -np.array(z)])
        assert (np.array(z) < 0.0).all()
        assert seen[0].max() <= 0.3 + 1e-9
        assert seen[0].min() >= -0.5 - 1e-9
        assert np.abs(seen[1]).max() <= 0.2 + 1e-9
        touched = [seen[0].max() > 0.3 - 1e-9 and seen[0].min() < -0.5 + 1e-9, np.ptp(seen[1]) > 0.4 - 1e-9]
        assert any(touched)


def test_scales_are_those_of_pictures(ask: Ask) -> None:
    for name in ("mises", "pressure", "principal_stress", "damage", "plastic_strain", "temperature", "speed"):
        field = FIELDS[name]
        found = ask("scales.js", f"[page.scaleOf('{name}'), page.ramp(page.scaleOf('{name}').colours)]")
        assert found[0]["label"] == field.label
        assert found[0]["centred"] == (field.kind == "centred")
        known = [scales.rgb(colour) for colour in scales.blend(field.colours)]
        assert np.abs(np.array(found[1]).reshape(-1, 4)[:, :3] - np.array(known)).max() <= 1
        assert min(sum(colour) for colour in known) >= 130, "no end is black"
    spans = [(0.0, 1.0), (-3.2e9, 7.7e9), (0.013, 0.0131), (293.15, 1498.9), (5.0, 5.0)]
    found = ask("scales.js", "data.map(([low, high]) => page.rounded(low, high).slice(0, 2))", spans)
    assert found == [pytest.approx(list(scales.rounded(low, high))) for low, high in spans]


def test_the_ends_of_a_scale_are_those_that_are_chosen(ask: Ask, made: bytes) -> None:
    header = Snapshot(made).header.fields["speed"]
    ranges = [[0.0, 10.0, 90.0, 100.0], [0.0, 20.0, 190.0, 900.0]]
    choices = {("all", "run"): (0.0, 1000.0), ("most", "run"): (10.0, 200.0), ("hand", "run"): (3.0, 4.0)}
    for (how, over), ends in choices.items():
        choice = json.dumps({"how": how, "over": over, "hand": [3.0, 4.0]})
        found = ask("ranges.js", f"page.range({choice}, 'speed', null, data)", ranges)
        assert (found["low"] <= ends[0], found["high"] >= ends[1] - 1e-9, found["high"]) == (True, True, ends[1])
    one = ask("ranges.js", "page.range({ how: 'all', over: 'now' }, 'speed', [data], [])", decoded(ask, made))
    assert one["low"] <= header.low
    assert one["high"] >= header.high


def test_what_the_browser_keeps_is_used_where_it_has_the_kind_that_is_wanted(ask: Ask) -> None:
    script = """((globalThis.localStorage = { getItem: () => data[0] }), page.recall("x", data[1]))"""
    sort = {"id": "submitted", "down": True}
    for text in ("null", "5", '"a"', "[]", "{", "[1]", '{"id":5,"down":true}', '{"id":"a"}', "\u202e"):
        assert ask("storage.js", script, [text, sort]) == sort, text
    for text, otherwise in (
        ("null", []),
        ("[null]", []),
        ("{}", []),
        ("[]", {}),
        ("null", {}),
        ("{}", ""),
        ("1", False),
    ):
        assert ask("storage.js", script, [text, otherwise]) == otherwise, text
    for kept, wanted in (
        ({"id": "a", "down": False}, sort),
        (["a"], []),
        ({"a": True}, {}),
        ("b", ""),
        (True, False),
    ):
        assert ask("storage.js", script, [json.dumps(kept), wanted]) == kept


def test_a_section_begins_inside_of_the_tets_of_a_quarter_model(ask: Ask) -> None:
    box = [[0.0, 0.0, -0.1], [0.02, 0.04, 0.0]]
    for middle, normal, place in (
        (0.0, [1, 0, 0], 0.0004),
        (0.0, [-1, 0, 0], -0.0004),
        (0.01, [1, 0, 0], 0.01),
        (9.0, [0, 0.6, 0.8], 0.024 - 0.02 * 0.104),
    ):
        assert ask("section.js", "page.within(...data)", [middle, box, normal]) == pytest.approx(place)


def test_the_tooltip_of_any_chart_stays_text(ask: Ask) -> None:
    globals_ = "globalThis.getComputedStyle = () => ({ getPropertyValue: () => '' }); globalThis.document = {};"
    script = f"(() => {{ {globals_} return page.whole(true, {{ tooltip: {{ trigger: 'axis' }} }}).tooltip; }})()"
    texts = ask("axes.js", script)
    assert (texts["renderMode"], texts["trigger"]) == ("richText", "axis")
    assert "common(" not in (WEB / "charts.js").read_text()


def test_walls_stand_where_the_snapshot_has_them(ask: Ask) -> None:
    """The case is the resolved case, in which absent keys are null."""
    walls: list[dict[str, Any]] = [
        {"kind": "wall", "point": [0, 0, -1], "normal": [0, 0, 2]},
        {"kind": "wall", "name": "wall_1", "shape": "sphere", "point": [0, 0, 9], "radius": 2, "mass": 1},
        {
            "kind": "wall",
            "name": "wall_2",
            "shape": "cylinder",
            "point": [5, 7, 0],
            "axis": [0, 1, 0],
            "radius": 1,
            "velocity": [0, 0, 0],
        },
        {"kind": "wall", "name": "wall_3", "point": [0, 0, 9], "normal": [0, 0, -1], "velocity": [0, 0, -3]},
        {"kind": "symmetry", "axis": "x"},
    ]
    mesh = {"shape": "box", "low": [0, 0, 0], "high": [1, 1, 1], "element_size": 1}
    case = {"name": "w", "run": {"end_time": 1}, "parts": [{"name": "a", "material": "steel", "mesh": mesh}]}
    plan = parse_case({**case, "boundaries": walls}).model_dump(mode="json")
    script = """page.wallsOf(data.plan).map((wall, k) => page.placed(wall, data.walls[k], [[0, 0, 0], [2, 2, 2]]))
        .map((at) => at && [at.centre, at.along, Math.round(at.radius * 100) / 100])"""
    here = [[0, 0, -1], [0, 0, 4], [5, 7, 0], [0, 0, 3]]
    assert ask("walls.js", script, {"plan": plan, "walls": here}) == [
        [[1, 1, -1], [0, 0, 1], 2.34], [[0, 0, 4], [0, 0, 1], 2], [[5, 1, 0], [0, 1, 0], 1],
        [[1, 1, 3], [0, 0, -1], 2.34],
    ]  # fmt: skip
    unknown = ask("walls.js", script, {"plan": plan, "walls": []})
    assert [at is None for at in unknown] == [False, True, False, True], "positions of moving walls are not known"
