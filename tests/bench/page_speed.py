"""Speed of the page: the command is ``python -m tests.bench.page_speed RUN``; RUN is the folder of a finished run.

A browser with software rendering opens two runs that no solver computed: one run with a snapshot of 50,000 triangles
and a few events, one run with 200,000 triangles and a million events. The command prints the time of the first paint,
the time of the history of a million events (first and second request), the time of the page with this history, and the
time from an address to the first picture of the body. The command also prints script time and draw calls per frame,
frames per second, and CPU time per frame of all processes of the browser. Other load on the machine affects the CPU
time less than the other numbers.
"""

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import httpx2

from tests.server.chromium import Browser
from tests.server.visitor import SHOWN, Site, sign_in

from .page_scene import lay

_FRAMES = 5.0
"""Time for which the body is rotated, s (chosen value)."""
_LEAST = 5
"""Number of frames that are drawn, for any duration of a frame (chosen value)."""
_TURN = f"""(async () => {{
  const canvas = document.querySelector(".view3d canvas");
  canvas.scrollIntoView({{ block: "center" }});
  await new Promise((done) => setTimeout(done, 1000));
  seen.frames.length = 0;
  const start = performance.now();
  let drawn = 0;
  for (; performance.now() - start < {1000 * _FRAMES} || drawn < {_LEAST}; drawn += 1) {{
    canvas.dispatchEvent(new KeyboardEvent("keydown", {{ key: "ArrowLeft" }}));
    await new Promise(requestAnimationFrame);
    const gl = canvas.getContext("webgl2");
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  }}
  const seconds = (performance.now() - start) / 1000;
  while (seen.frames.length < drawn - 1) await new Promise((done) => setTimeout(done, 100));
  return [seconds, drawn];
}})()"""
"""A pixel is read after each frame, so that a frame counts when it is drawn, not when it is requested."""


def main(arguments: list[str]) -> None:
    """Creates the two runs, opens the runs, and prints a line for each number."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("run", type=Path)
    words.add_argument("--events", type=int, default=1_000_000)
    options = words.parse_args(arguments)
    with tempfile.TemporaryDirectory() as scratch:
        site = Site(Path(scratch) / "runs")
        site.kill()
        ids = {50_000: "1k0aaaaaaaaaaaaaaaaaaa", 200_000: "1k0bbbbbbbbbbbbbbbbbbb"}
        for triangles, events in ((50_000, 300), (200_000, options.events)):
            lay(site.runs / ids[triangles], options.run, events, triangles)
        try:
            site.start()
            print(f"load of the machine: {os.getloadavg()[0]:.0f} on {os.cpu_count()} cores")
            _history(site, ids[200_000], options.events)
            with Browser(Path(scratch) / "profile") as browser:
                _page(browser, site, ids)
        finally:
            site.process.terminate()
            site.process.wait(60)


def _history(site: Site, run: str, events: int) -> None:
    for which in ("cold", "again"):
        start = time.perf_counter()
        shown = {"Authorization": f"Bearer {site.token}"}
        answer = httpx2.get(f"{site.url}v1/runs/{run}/history?points=1000", headers=shown, timeout=120)
        assert answer.status_code == 200, answer.text
        size = (site.runs / run / "journal.jsonl").stat().st_size
        print(f"history of {events:,} events ({size / 1e6:.0f} MB), {which}: {time.perf_counter() - start:.2f} s")


def _cpu(browser: Browser) -> float:
    """Returns the CPU time of all processes of the browser, s."""
    return float(sum(one["cpuTime"] for one in browser.call("SystemInfo.getProcessInfo")["processInfo"]))


def _page(browser: Browser, site: Site, ids: dict[int, str]) -> None:
    page = browser.page()
    sign_in(page, site)
    paint = "performance.getEntriesByType('paint').find((one) => one.name === 'first-contentful-paint')?.startTime"
    print(f"first paint: {page.wait(paint):.0f} ms")
    for triangles, run in ids.items():
        start = time.perf_counter()
        page.go(f"{site.url}#/runs/{run}")
        page.wait(SHOWN)
        print(f"page of the run, until its body and charts stand: {time.perf_counter() - start:.2f} s")
        page.go(f"{site.url}?{triangles}#/runs/{run}")
        print(f"first picture: {page.wait('window.seen?.frames[0]')[0]:.0f} ms after the address was opened")
        before = _cpu(browser)
        seconds, drawn = page.evaluate(_TURN)
        frames = page.evaluate("seen.frames")
        cpu = _cpu(browser) - before
        script = [duration for _, duration, _ in frames]
        print(
            f"{triangles:,} triangles: {drawn / seconds:.1f} frames/s, script {median(script):.2f} ms a frame "
            f"(least {min(script):.2f}), {max(calls for *_, calls in frames)} draw calls, "
            f"{1000 * cpu / drawn:.0f} ms CPU a frame"
        )
    assert page.errors == [], page.errors


if __name__ == "__main__":
    main(sys.argv[1:])
