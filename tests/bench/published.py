"""Speed-ups measured by Moon, Kim and Lee, compared with those of ``conoid bench scale --out FOLDER``.

The command ``python -m tests.bench.published FOLDER`` prints a table and draws FOLDER/published.svg.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

from conoid.client.studies import chart
from conoid.client.studies.study import Study, from_json, table


@dataclass(frozen=True)
class Published:
    """Measurements of Moon, Kim and Lee for a case."""

    figure: str
    speed_up: dict[int, float]
    """Speed-up by number of processors, as far as the text of the paper has numbers."""
    rebalances: str

    @property
    def source(self) -> str:
        """Place of the measurements in the paper."""
        return f"Moon, Kim and Lee, {self.figure}"


PAPER = {
    "long_rod": Published("fig. 14", {32: 23.79}, "no rebalances"),
    "glass_steel_bar": Published("fig. 19", {16: 0.77 * 16, 32: 18.74}, "18 rebalances on 16"),
}
"""Published measurements by case. The text of the paper has 58 % for fig. 19 on 32 processors, which is the speed-up of
18.74 in its conclusion."""


def compared(study: Study) -> str:
    """Returns the published speed-ups beside the projected ones, as Markdown. Raises KeyError if the case has no
    published speed-up."""
    paper = PAPER[study.case]
    projected = {run.ranks: study.speed_up(run) for run in study.runs if run.threads == 1 and not run.by_tasks}
    rows = []
    for ranks in sorted({*paper.speed_up, *projected} - {1}):
        cells = [f"{each[ranks]:.2f}" if ranks in each else "-" for each in (paper.speed_up, projected)]
        shares = [f"{100 * each[ranks] / ranks:.1f}" if ranks in each else "-" for each in (paper.speed_up, projected)]
        rows.append([str(ranks), *cells, *shares])
    head = ("ranks", "measured there", "projected here", "efficiency there %", "efficiency here %")
    return f"`{study.case}`: {paper.source}, with {paper.rebalances}\n\n{table(head, rows)}\n"


def drawn(study: Study) -> str:
    """Returns the chart of the study as SVG, with the published points if the case has published points."""
    paper = PAPER.get(study.case)
    return chart.speed_up(study, paper.speed_up, paper.source) if paper else chart.speed_up(study)


def main(folder: Path) -> None:
    """Compares the study in ``folder`` with the published speed-ups."""
    study = from_json((folder / "scale.json").read_bytes())
    print(compared(study), end="")
    (folder / "published.svg").write_text(drawn(study), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
