"""A Chromium browser without a window, driven by tests. The tests send commands of the DevTools protocol to the browser
over a pipe; the browser draws by software.

The site https://chromedevtools.github.io/devtools-protocol describes the methods that are called here.
"""

import base64
import fcntl
import json
import os
import queue
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_OPTIONS = (
    "--headless=new", "--remote-debugging-pipe", "--no-sandbox", "--no-first-run", "--disable-extensions",
    "--disable-background-networking", "--disable-component-update", "--disable-dev-shm-usage", "--mute-audio",
    "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
)  # fmt: skip
_ONTO_3_AND_4 = "import os, sys; r, w, *a = sys.argv[1:]; os.dup2(int(r), 3); os.dup2(int(w), 4); os.execvp(a[0], a)"
"""Program that moves the pipes to the descriptors 3 and 4: the browser reads commands from descriptor 3 and writes
answers to descriptor 4."""
_PATIENCE = 60.0
_NOTHING = (None, False, 0, "")
"""Values that are false in JavaScript. The protocol sends an element of the page as an empty dict, which counts as
true."""
_BUTTON = {"button": "left", "clickCount": 1}
KEYS = {"Enter": 13, "Escape": 27, "Tab": 9, " ": 32, "ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40}
"""Keys that a test can press, with the Windows key codes that the protocol requires."""

MEASURES = """
window.seen = {frames: [], events: []};
new PerformanceObserver((list) => list.getEntries().forEach(({ name, duration, startTime, detail }) => {
  if (name === "conoid:frame") seen.frames.push([startTime, duration, detail.calls]);
  if (name === "conoid:event") seen.events.push(duration);
})).observe({ type: "measure" });
"""
"""Script that stores the marks of the browser's timeline in ``window.seen``."""


def program() -> str | None:
    """Returns the path of the browser on this machine; None if no browser is installed."""
    return next((found for name in PROGRAMS if (found := shutil.which(name))), None)


class PageError(Exception):
    """Error: a script of the page has failed, or a condition did not become true in time."""


class Browser:
    """A browser with an empty profile; a context manager."""

    def __init__(self, folder: Path) -> None:
        """Prepares the browser; ``folder`` is the folder of the browser's profile."""
        self._folder = folder
        self._lock = threading.Lock()
        self._answers: dict[int, queue.SimpleQueue[dict[str, Any]]] = {}
        self._listeners: dict[str, Callable[[str, dict[str, Any]], None]] = {}
        self._last = 0

    def __enter__(self) -> Self:
        """Starts the browser."""
        ours, theirs = os.pipe(), os.pipe()
        into, out_of = (fcntl.fcntl(fd, fcntl.F_DUPFD, 10) for fd in (ours[0], theirs[1]))
        launch = [sys.executable, "-c", _ONTO_3_AND_4, str(into), str(out_of), program() or PROGRAMS[0]]
        self._process = subprocess.Popen(
            [*launch, *_OPTIONS, f"--user-data-dir={self._folder}", "about:blank"], pass_fds=(into, out_of),
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip
        for fd in (ours[0], theirs[1], into, out_of):
            os.close(fd)
        self._to, self._from = os.fdopen(ours[1], "wb", 0), os.fdopen(theirs[0], "rb")
        threading.Thread(target=self._listen, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        """Ends the browser."""
        try:
            self.call("Browser.close")
            self._process.wait(10)
        except (OSError, PageError, subprocess.TimeoutExpired):
            self._process.kill()
            self._process.wait()
        self._to.close()

    def page(
        self,
        width: int = 1280,
        height: int = 720,
        *,
        dark: bool = False,
        phone: bool = False,
        beside: "Page | None" = None,
    ) -> "Page":
        """Opens an empty page with its own profile, or with the profile of another page."""
        context = beside.context if beside else self.call("Target.createBrowserContext")["browserContextId"]
        target = self.call("Target.createTarget", url="about:blank", browserContextId=context)["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = Page(self, session, target, context)
        self._listeners[session] = page.on_event
        page.open(width, height, dark=dark, phone=phone)
        return page

    def call(self, method: str, session: str = "", /, **params: Any) -> dict[str, Any]:
        """Calls a method of the protocol and returns the answer of the browser. Raises PageError if the browser answers
        with an error.
        """
        answer: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        number = self.send(method, session, answer, **params)
        try:
            found = answer.get(timeout=_PATIENCE)
        except queue.Empty:
            raise PageError(f"{method}: no answer") from None
        finally:
            self._answers.pop(number, None)
        if "error" in found:
            raise PageError(f"{method}: {found['error']['message']}")
        result: dict[str, Any] = found["result"]
        return result

    def send(
        self, method: str, session: str, answer: "queue.SimpleQueue[dict[str, Any]] | None" = None, **params: Any
    ) -> int:
        """Calls a method of the protocol without waiting for the answer; returns the number of the call."""
        with self._lock:
            self._last += 1
            number = self._last
            if answer is not None:
                self._answers[number] = answer
            request = {"id": number, "method": method, "params": params, **({"sessionId": session} if session else {})}
            self._to.write(json.dumps(request).encode() + b"\0")
        return number

    def _listen(self) -> None:
        rest = b""
        while data := self._from.read1(1 << 20):
            *whole, rest = (rest + data).split(b"\0")
            for text in whole:
                received = json.loads(text)
                if received.get("id") in self._answers:
                    self._answers[received["id"]].put(received)
                elif "method" in received and (listener := self._listeners.get(received.get("sessionId", ""))):
                    listener(received["method"], received["params"])
        self._from.close()


class Page:
    """One page of the browser: actions of a user, and events that the browser reports."""

    def __init__(self, browser: Browser, session: str, target: str, context: str) -> None:
        self._browser, self._session, self._target, self.context = browser, session, target, context
        self.errors: list[str] = []
        """Errors of the console, scripts that have failed, and requests that the server answered with an error."""
        self.answers: list[tuple[int, str]] = []
        """Status and address of each request to the server."""

    def open(self, width: int, height: int, *, dark: bool, phone: bool) -> None:
        """Sets the size and the theme of the window and subscribes to events."""
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.size(width, height, phone=phone)
        theme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[theme])
        self.call("Page.addScriptToEvaluateOnNewDocument", source=MEASURES)

    def size(self, width: int, height: int, *, phone: bool = False) -> None:
        """Size of the window, px."""
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=phone)

    def call(self, method: str, /, **params: Any) -> dict[str, Any]:
        """Calls a method of the protocol for this page. Raises PageError if the browser answers with an error."""
        return self._browser.call(method, self._session, **params)

    def on_event(self, method: str, params: dict[str, Any]) -> None:
        """Handles an event of this page, in the thread that reads the pipe."""
        if method == "Runtime.consoleAPICalled" and params["type"] == "error":
            self.errors.append(" ".join(str(one.get("value", one.get("description"))) for one in params["args"]))
        elif method == "Runtime.exceptionThrown":
            self.errors.append(_failure(params["exceptionDetails"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.errors.append(f"{params['entry']['text']} {params['entry'].get('url', '')}")
        elif method == "Network.responseReceived":
            self.answers.append((params["response"]["status"], params["response"]["url"]))
        elif method == "Page.javascriptDialogOpening":
            self._browser.send("Page.handleJavaScriptDialog", self._session, accept=True)

    def go(self, url: str) -> None:
        """Opens an address."""
        self.call("Page.navigate", url=url)
        self.wait("document.readyState === 'complete'")

    def evaluate(self, script: str) -> Any:
        """Returns the value of a JavaScript expression; if the value is a promise, the value with which the promise
        resolves. Raises PageError if the expression fails.
        """
        found = self.call(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True, userGesture=True
        )
        if "exceptionDetails" in found:
            raise PageError(f"{script[:80]}: {_failure(found['exceptionDetails'])}")
        return found["result"].get("value")

    def wait(self, script: str, seconds: float = _PATIENCE) -> Any:
        """Waits until an expression is true and returns the value of the expression. Raises PageError if the expression
        does not become true in time.
        """
        until = time.monotonic() + seconds
        while (value := self.evaluate(script)) in _NOTHING:
            if time.monotonic() > until:
                raise PageError(f"not in {seconds:g} s: {script}; the page shows: {self.text()[:400]!r}")
            time.sleep(0.05)
        return value

    def text(self, selector: str = "body") -> str:
        """Returns the visible text of the element with a selector; empty if there is no such element."""
        return str(self.evaluate(f"document.querySelector({json.dumps(selector)})?.innerText ?? ''"))

    def place(self, selector: str, right: float = 0.5, down: float = 0.5) -> tuple[float, float]:
        """Scrolls an element into view and returns the position of a point in the element, px. The point is given by
        fractions of the element's size.
        """
        box = self.wait(f"""(() => {{
          const element = document.querySelector({json.dumps(selector)});
          element?.scrollIntoView({{ block: "center", behavior: "instant" }});
          const box = element?.getBoundingClientRect();
          return box && box.width > 0 && [box.x, box.y, box.width, box.height];
        }})()""")
        return box[0] + right * box[2], box[1] + down * box[3]

    def click(self, selector: str, right: float = 0.5, down: float = 0.5) -> None:
        """Clicks on an element with the pointer."""
        self.click_at(*self.place(selector, right, down))

    def click_at(self, x: float, y: float) -> None:
        """Clicks at a position of the window."""
        self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
        self.call("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, **_BUTTON)
        self.call("Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y, **_BUTTON)

    def press(self, key: str, modifiers: int = 0) -> None:
        """Presses a key in the element that has the focus; ``modifiers`` is the sum of 1 for Alt, 2 for Ctrl and 8 for
        Shift.
        """
        text = {"Enter": "\r"}.get(key, key if len(key) == 1 else "")
        known = {"key": key, "code": key, "windowsVirtualKeyCode": KEYS.get(key, ord(key[0])), "modifiers": modifiers}
        self.call("Input.dispatchKeyEvent", type="keyDown", **known, **({"text": text} if text else {}))
        self.call("Input.dispatchKeyEvent", type="keyUp", **known)

    def write(self, selector: str, text: str) -> None:
        """Types text into a field."""
        self.focus(selector)
        self.call("Input.insertText", text=text)

    def focus(self, selector: str) -> None:
        """Moves the focus to an element."""
        self.wait(f"document.querySelector({json.dumps(selector)})?.focus() === undefined")

    def slide(self, selector: str, value: float | str) -> None:
        """Sets a slider or a list of choices to a value, with the events of a user's action."""
        self.wait(f"!!document.querySelector({json.dumps(selector)})")
        self.evaluate(f"""(() => {{
          const element = document.querySelector({json.dumps(selector)});
          element.value = {json.dumps(value)};
          element.dispatchEvent(new Event("input", {{ bubbles: true }}));
          element.dispatchEvent(new Event("change", {{ bubbles: true }}));
        }})()""")

    def draw(self, path: Path, *, whole: bool = False) -> None:
        """Takes a screenshot of the window, or of the whole page."""
        found = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(found["data"]))

    def close(self) -> None:
        """Closes the page."""
        self._browser.call("Target.closeTarget", targetId=self._target)


def _failure(details: dict[str, Any]) -> str:
    exception = details.get("exception", {})
    return str(exception.get("description") or exception.get("value") or details.get("text"))
