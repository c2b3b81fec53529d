"""Speed-up against ranks, drawn as SVG: projected, as measured where there are cores enough, and the paper's."""

import math
from collections.abc import Mapping

from .study import Study

_WIDTH, _HEIGHT, _LEFT, _TOP, _SIDE = 460, 400, 56, 36, 320
_BLUE, _RED, _GREY = "#1b6ca8", "#c8553d", "#999999"


def speed_up(study: Study) -> str:
    """The figure; both axes are logarithmic."""
    one = study.runs[0]
    projected = {run.ranks: study.speed_up(run) for run in study.runs}
    measured = {run.ranks: one.wall / run.wall for run in study.runs if run.ranks <= study.cores}
    decades = max(1, math.ceil(math.log2(max([2, *projected, *study.paper]))))
    paper = f"Moon, Kim and Lee, {study.case}"
    return "\n".join([
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {_HEIGHT}" font-family="sans-serif" '
        'font-size="12">',
        f'<rect width="{_WIDTH}" height="{_HEIGHT}" fill="white"/>',
        f'<text x="{_LEFT}" y="20" font-size="14">{study.case}: speed-up, projected with a core a rank</text>',
        *(_grid(2**power, decades) for power in range(decades + 1)),
        _line({1: 1.0, 2**decades: 2.0**decades}, decades, _GREY, "4 4"),
        _line(projected, decades, _BLUE),
        *(_mark(ranks, value, decades, _BLUE, _BLUE) for ranks, value in projected.items()),
        *(_mark(ranks, value, decades, _BLUE, "white") for ranks, value in measured.items()),
        *(_mark(ranks, value, decades, _RED, _RED) for ranks, value in study.paper.items()),
        _legend(0, "projected", _BLUE, _BLUE), _legend(1, "wall time", _BLUE, "white"),
        *([_legend(2, paper, _RED, _RED)] if study.paper else []),
        f'<text x="{_LEFT + _SIDE / 2}" y="{_TOP + _SIDE + 36}" text-anchor="middle">ranks</text>',
        "</svg>", "",
    ])  # fmt: skip


def _place(ranks: float, value: float, decades: int) -> tuple[float, float]:
    unit = _SIDE / decades
    return _LEFT + unit * math.log2(ranks), _TOP + _SIDE - unit * max(math.log2(value), 0.0)


def _grid(number: int, decades: int) -> str:
    x, y = _place(number, number, decades)
    return (
        f'<path d="M{x:.1f} {_TOP}V{_TOP + _SIDE}M{_LEFT} {y:.1f}H{_LEFT + _SIDE}" stroke="#dddddd"/>'
        f'<text x="{x:.1f}" y="{_TOP + _SIDE + 18}" text-anchor="middle">{number}</text>'
        f'<text x="{_LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{number}</text>'
    )


def _line(values: Mapping[int, float], decades: int, colour: str, dashes: str = "none") -> str:
    points = " ".join("{:.1f},{:.1f}".format(*_place(ranks, value, decades)) for ranks, value in values.items())
    return f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5" stroke-dasharray="{dashes}"/>'


def _mark(ranks: float, value: float, decades: int, colour: str, fill: str) -> str:
    x, y = _place(ranks, value, decades)
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{fill}" stroke="{colour}" stroke-width="1.5"/>'


def _legend(row: int, text: str, colour: str, fill: str) -> str:
    x, y = _LEFT + 16, _TOP + 18 + 20 * row
    return (
        f'<circle cx="{x}" cy="{y - 4}" r="4" fill="{fill}" stroke="{colour}" stroke-width="1.5"/>'
        f'<text x="{x + 12}" y="{y}">{text}</text>'
    )
