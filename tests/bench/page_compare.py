"""Speed of the page that compares runs: the command is ``python -m tests.bench.page_compare``.

The server has 200 runs that no solver computed (``many``). A browser with software rendering compares twelve runs of a
sweep. The study measures the times until the charts and the table of values and results are complete, and the time to
hide a run. Each time is measured twice: at the first load of the scripts, and at a second load.
"""

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

from tests.server.chromium import Browser, Page
from tests.server.visitor import Site, sign_in

from .many import lay

_COMPARED = 12
_DRAWN = """(() => {
  const charts = [...document.querySelectorAll(".charts .plot")];
  return document.querySelectorAll("table.outcomes tbody tr").length === %d && charts.length > 2 &&
    charts.filter((one) => one.getBoundingClientRect().top < innerHeight).every((one) => one.querySelector("canvas"));
})()"""
_HIDDEN = """(async () => {
  const start = performance.now();
  document.querySelector(".run-lines button[aria-pressed=true]").click();
  const took = performance.now() - start;
  await new Promise(requestAnimationFrame);
  return took;
})()"""


def main(arguments: list[str]) -> None:
    """Creates the runs, compares some of the runs, and prints a line for each measured time."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--runs", type=int, default=200)
    words.add_argument("--compared", type=int, default=_COMPARED)
    words.add_argument("--picture", type=Path)
    options = words.parse_args(arguments)
    with tempfile.TemporaryDirectory() as scratch:
        site = Site(Path(scratch) / "runs")
        site.kill()
        ids = lay(site.runs, options.runs)
        site.start()
        try:
            print(f"load of the machine: {os.getloadavg()[0]:.0f} on {os.cpu_count()} cores")
            with Browser(Path(scratch) / "profile") as browser:
                page = browser.page(1920, 1080)
                sign_in(page, site)
                for which in ("first", "again"):
                    _open(page, site, alike(site.runs, ids, options.compared), which)
                if options.picture:
                    page.draw(options.picture)
                assert page.errors == [], page.errors
        finally:
            site.process.terminate()
            site.process.wait(60)


def alike(runs: Path, ids: list[str], number: int) -> list[str]:
    """Returns consecutive runs, of the same case if there are enough such runs."""
    sizes = {run: (runs / run / "case.resolved.json").stat().st_size for run in ids}
    starts = range(len(ids) - number + 1)
    first = min(starts, key=lambda k: len({sizes[run] // 64 for run in ids[k : k + number]}))
    return ids[first : first + number]


def _open(page: Page, site: Site, ids: list[str], which: str) -> None:
    page.go(f"{site.url}#/")
    time.sleep(1.0)
    start = time.perf_counter()
    page.evaluate(f"location.hash = '#/compare/{'/'.join(ids)}'; true")
    page.wait(_DRAWN % len(ids))
    print(f"{len(ids)} runs compared, {which}: {time.perf_counter() - start:.2f} s until charts and table stand")
    took = [page.evaluate(_HIDDEN) for _ in range(3)]
    print(f"hiding a run: {min(took):.0f} ms of script")


if __name__ == "__main__":
    main(sys.argv[1:])
