"""Tools of the body on the page, in node: a typed time, the removed side of a section, the parts of a fragment."""

import pytest

from .node import NODE, Ask

pytestmark = pytest.mark.skipif(NODE is None, reason="no node on this machine")


def test_a_typed_time_selects_the_nearest_snapshot(ask: Ask) -> None:
    """A number without a unit has the unit of the shown time; a text that is no time selects nothing."""
    texts = ["20 us", "20µs", "0.02 ms", "2e-5 s", " 20 ", "20000 NS", "1e-5s", "", "soon", "20 km", "1.2.3", "-5 us"]
    times = ask("moment.js", 'data.map((text) => page.typedTime(text, "60.0 µs"))', texts)
    assert times[:7] == pytest.approx([2e-5] * 6 + [1e-5])
    assert times[7:] == [None] * 5
    chosen = ask("moment.js", "data[1].map((t) => page.nearestTo(data[0], t))", [[0, 1e-6, 4e-6], [0, 2e-6, 3e-6, 1]])
    assert chosen == [0, 1, 2, 2]


def test_a_view_across_a_section_cuts_away_the_side_towards_the_camera(ask: Ask) -> None:
    """An inclined view, a view along another axis, and a view without a section keep the side."""
    script = """data.map(([across, on, flipped, back]) => {
      const tools = { across: { value: across }, flipped };
      const plane = Object.assign(new page.SectionPlane(tools), { on });
      return [plane.face({ back: () => back }), tools.flipped];
    })"""
    views = [
        ("x", True, True, [1, 0, 0]), ("x", True, False, [-1, 0, 0]), ("x", True, False, [1, 0, 0]),
        ("x", True, True, [0.8, 0.6, 0]), ("x", True, True, [0, 0, 1]), ("as seen", True, True, [1, 0, 0]),
        ("x", False, True, [1, 0, 0]),
    ]  # fmt: skip
    found = ask("plane.js", script, views)
    assert found == [[True, False], [True, True], [False, False], *[[False, True]] * 4]


def test_a_fragment_has_the_names_of_its_parts(ask: Ask) -> None:
    """Triangles of two parts with common nodes belong to one fragment; the row of the rest has no triangle."""
    data = {"parts": ["core", "jacket", "tile"], "ids": [5, 7, -1], "vertices": [0, 0, 0, 1, 1, 1],
            "triangles": [0, 1, 2, 2, 1, 0, 3, 4, 5], "part": [0, 1, 2]}  # fmt: skip
    script = """page.partsOf({ header: { parts: data.parts }, arrays: {
      fragment_id: data.ids, vertex_fragment: data.vertices, triangles: data.triangles, triangle_part: data.part } })"""
    assert ask("snapshot.js", script, data) == ["core + jacket", "tile", ""]
