"""Limits of the size of files, functions, kernels, classes and calls of the houses, with their exceptions."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
HOUSES = ("cases", "client", "server", "worker")
LONGEST_FILE, LONGEST_FUNCTION, LONGEST_KERNEL, MOST_ATTRIBUTES = 300, 50, 80, 15
"""Chosen values: a file can be read at one sitting, and a function and an object can be understood at a glance."""
SMALL, FEWEST_ATTRIBUTES, MOST_PARAMETERS = ("worker/contact/", "worker/fracture/"), 12, 12
"""Folders with stricter limits, because these folders were the largest in earlier versions; chosen values."""
EXCEPTIONS: dict[str, dict[str, int]] = {
    "a record: an attribute for each key, column or account that it holds": {
        "cases/laws/johnson_holmquist.py: JohnsonHolmquist": 18,
        "cases/outcome.py: Outcome": 42,
        "cases/output/search.py: Search": 17,
        "client/decks/draft.py: Draft": 16,
        "client/decks/lsdyna/reading.py: LsDyna": 17,
        "client/drawing/picture.py: Picture": 17,
        "client/drawing/view_options.py: Look": 24,
        "client/live.py: Live": 23,
        "client/remote/run_info.py: RunInfo": 18,
        "client/studies/projection.py: Projection": 22,
        "server/answers/history.py: History": 20,
        "server/intake/plans.py: Plan": 16,
        "server/keeping/removed_runs.py: RemovedRun": 17,
        "server/runs/folder.py: Submission": 17,
        "worker/clock.py: Clock": 17,
        "worker/contact/solver/solver.py: _Room": 17,
        "worker/contact/solver/step.py: SolverStep": 14,
        "worker/model/state.py: Block": 26,
        "worker/reduction.py: Fields": 16,
        "worker/reduction.py: StepReduction": 18,
        "worker/rigid/bodies.py: Bodies": 18,
        "worker/scene/assembly.py: Whole": 16,
        "worker/scene/domain.py: Piece": 29,
    },
    "a stage of the step: it wires arrays, kernels and neighbours that are made once": {
        "worker/contact/exterior.py: Exterior": 15,
        "worker/contact/broad_phase/searches.py: Searches": 14,
        "worker/contact/narrow_phase/detection.py: Detection": 19,
        "worker/contact/scene/scene.py: Scene": 15,
        "worker/contact/solver/solver.py: ActiveSet": 14,
        "worker/contact/stage.py: Contact": 14,
        "worker/run/loop.py: Loop": 16,
        "worker/simulation.py: Simulation": 24,
    },
    "a part of the server: it wires others that are made once": {
        "server/keeping/removal.py: Removal": 16,
        "server/launch/slurm_run.py: SlurmWorker": 20,
        "server/runs/supervisor.py: Supervisor": 18,
        "server/service.py: Service": 23,
    },
    "one passage: it makes objects in order of dependence, each from those before": {
        "server/app.py: opened": 61,
    },
    "to be split by subject": {
        "worker/contact/scene/columns.py: SceneSlots": 13,
    },
}
"""Larger files, functions and classes with the reason and their exact sizes: when the code becomes smaller, the numbers
must be lowered."""


def attributes(cls: ast.ClassDef) -> int:
    """Returns the fields that a class declares, and the attributes that the methods of the class set."""
    declared = {n.target.id for n in cls.body if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)}
    stored = (n for n in ast.walk(cls) if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store))
    return len(declared | {n.attr for n in stored if isinstance(n.value, ast.Name) and n.value.id == "self"})


def parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    given = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    return sum(each.arg not in ("self", "cls") for each in given)


def excesses(name: str, source: str) -> Iterator[tuple[str, int]]:
    """Yields the names that exceed a limit in a file: ``FILE``, ``FILE: CLASS``, ``FILE: FUNCTION`` or ``FILE:
    FUNCTION(...)``.
    """
    small = name.startswith(SMALL)
    if (lines := len(source.splitlines())) > LONGEST_FILE:
        yield name, lines
    for node in ast.walk(ast.parse(source)) if name.endswith(".py") else ():
        if isinstance(node, ast.ClassDef) and attributes(node) > (FEWEST_ATTRIBUTES if small else MOST_ATTRIBUTES):
            yield f"{name}: {node.name}", attributes(node)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            kernel = any("njit" in ast.unparse(each) for each in node.decorator_list)
            long = (node.end_lineno or 0) - node.lineno + 1
            if long > (LONGEST_KERNEL if kernel else LONGEST_FUNCTION):
                yield f"{name}: {node.name}", long
            if small and parameters(node) > MOST_PARAMETERS:
                yield f"{name}: {node.name}(...)", parameters(node)


@cache
def found() -> dict[str, int]:
    """Returns all names of the houses that exceed a limit."""
    every = [path for house in HOUSES for path in (ROOT / house).rglob("*") if path.suffix in (".py", ".js", ".css")]
    named = {path.relative_to(ROOT).as_posix(): path for path in sorted(every)}
    return dict(each for name, path in named.items() for each in excesses(name, path.read_text(encoding="utf-8")))


def test_what_exceeds_a_limit_is_an_exception_of_exactly_its_size() -> None:
    assert found() == {name: size for group in EXCEPTIONS.values() for name, size in group.items()}


def test_each_excess_is_found() -> None:
    long = "def f(a):\n" + "    a += 1\n" * 50
    wide = "class C:\n" + "".join(f"    a{i}: int\n" for i in range(16))
    many = f"def f({', '.join(f'a{i}' for i in range(13))}): ..."
    assert dict(excesses("cases/a.py", long)) == {"cases/a.py: f": 51}
    assert dict(excesses("cases/a.py", "@njit(sig)\n" + long)) == {}
    assert dict(excesses("cases/a.py", wide)) == {"cases/a.py: C": 16}
    assert dict(excesses("client/a.js", "\n" * 301)) == {"client/a.js": 301}
    assert dict(excesses("worker/contact/a.py", many)) == {"worker/contact/a.py: f(...)": 13}
