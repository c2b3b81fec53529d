"""Evaluation of the page's modules in node, without a browser."""

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .visitor import WEB

NODE = shutil.which("node")
"""Path of the program node; None if node is not installed."""
Ask = Callable[..., Any]
"""The function ``ask(modules, expression, data)`` returns the value of an expression; ``page`` in the expression has
the exports of the modules."""


def asking(web: Path) -> Ask:
    """Returns a function that evaluates expressions with copies of the page's modules in the folder ``web``."""
    for path in WEB.glob("*.js"):
        shutil.copy(path, web)
    (web / "package.json").write_text('{"type": "module"}')

    def asked(modules: str, script: str, data: Any = None) -> Any:
        question = json.dumps({"module": f"{web}/{modules}", "script": script, "data": data})
        command = [str(NODE), str(Path(__file__).with_name("scripts.mjs"))]
        done = subprocess.run(command, input=question, capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return asked
