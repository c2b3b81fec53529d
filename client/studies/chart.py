"""Chart of the speed-up over cores as SVG: projected values, values measured with a core for each thread, and values
of another source.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from .study import Study

_WIDTH, _HEIGHT, _LEFT, _TOP, _SIDE = 424, 464, 56, 36, 320
"""Sizes in pixels: width and height of the picture; left, top and side of the square of the axes. Numbers and legend
have space around the square (chosen values)."""
_BLUE, _RED, _GREY = "#1b6ca8", "#c8553d", "#999999"


@dataclass(frozen=True)
class _Frame:
    """Logarithmic axes: cores from 1 to 2^``most``, and speed-up from 2^``least`` to 2^``most``."""

    least: int
    most: int

    def place(self, ranks: float, value: float) -> tuple[float, float]:
        x, y = math.log2(ranks) / self.most, (math.log2(value) - self.least) / (self.most - self.least)
        return _LEFT + _SIDE * x, _TOP + _SIDE * (1.0 - y)

    def grid(self) -> str:
        drawn = []
        for power in range(self.least, self.most + 1):
            x, y = self.place(2 ** max(power, 0), 2.0**power)
            drawn.append(f'<path d="M{_LEFT} {y:.1f}h{_SIDE}M{x:.1f} {_TOP}v{_SIDE}" stroke="#dddddd"/>')
            drawn.append(f'<text x="{_LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{2.0**power:g}</text>')
            if power >= 0:
                drawn.append(f'<text x="{x:.1f}" y="{_TOP + _SIDE + 18}" text-anchor="middle">{2**power}</text>')
        return "\n".join(drawn)

    def line(self, values: Mapping[int, float], colour: str, dashes: str = "none") -> str:
        points = " ".join("{:.1f},{:.1f}".format(*self.place(*pair)) for pair in values.items())
        return f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-dasharray="{dashes}"/>'

    def marks(self, values: Mapping[int, float], colour: str, fill: str) -> str:
        return "\n".join(_mark(*self.place(*pair), colour, fill) for pair in values.items())

    def labels(self, values: Mapping[int, float], right: int, down: int) -> str:
        """Writes the value of each mark beside the mark."""
        places = ((*self.place(*pair), pair[1]) for pair in values.items())
        return "\n".join(f'<text x="{x + right:.1f}" y="{y + down:.1f}">{value:.2f}</text>' for x, y, value in places)


def speed_up(study: Study, others: Mapping[int, float] | None = None, source: str = "") -> str:
    """Returns the chart with logarithmic axes. ``others``: speed-ups measured by ``source``; the keys are numbers of
    ranks.
    """
    best = {run.cores: run for run in sorted(study.runs, key=study.speed_up)}
    projected = {cores: study.speed_up(run) for cores, run in sorted(best.items())}
    worst = {cores: study.runs[0].time / best[cores].worst for cores in projected}
    within = sorted((run for run in study.runs if study.within(run)), key=lambda run: run.cores)
    measured = {run.cores: study.runs[0].wall / run.wall for run in within}
    values = (*worst.values(), *measured.values())
    others = others or {}
    most = max(1, math.ceil(math.log2(max(*projected, *others, 2))))
    frame = _Frame(min(0, math.floor(math.log2(min(values)))), most)
    return "\n".join([
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {_HEIGHT}" font-family="sans-serif" '
        'font-size="12">',
        f'<rect width="{_WIDTH}" height="{_HEIGHT}" fill="white"/>', frame.grid(),
        frame.line({1: 1.0, 2**most: 2.0**most}, _GREY, "4 4"), frame.line(projected, _BLUE),
        frame.line(worst, _BLUE, "2 3"),
        frame.marks(projected, _BLUE, _BLUE), frame.marks(measured, _BLUE, "white"),
        frame.marks(others, _RED, _RED), frame.labels(others, 8, 4),
        frame.labels({ranks: value for ranks, value in projected.items() if ranks > 1}, -10, -10),
        _legend(0, "projected, best ranks x threads; dots: worst case", _BLUE, _BLUE),
        _legend(1, "wall time, this machine", _BLUE, "white"),
        *([_legend(2, f"measured, {source}", _RED, _RED)] if others else []),
        f'<text x="{_LEFT}" y="20" font-size="14">{study.case}: speed-up</text>',
        f'<text x="{_LEFT + _SIDE / 2}" y="{_TOP + _SIDE + 36}" text-anchor="middle">ranks x threads</text>',
        "</svg>", "",
    ])  # fmt: skip


def _mark(x: float, y: float, colour: str, fill: str) -> str:
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{fill}" stroke="{colour}" stroke-width="1.5"/>'


def _legend(row: int, text: str, colour: str, fill: str) -> str:
    x, y = _LEFT + 4, _TOP + _SIDE + 58 + 20 * row
    return _mark(x, y - 4, colour, fill) + f'<text x="{x + 12}" y="{y}">{text}</text>'
