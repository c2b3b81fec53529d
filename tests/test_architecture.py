"""The borders between the houses are checked in the source tree."""

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.version import Version

ROOT = Path(__file__).parents[1]
HOUSES = ("cases", "client", "server", "worker")
CONTRACT = {"pydantic", "pydantic_core", "msgspec"}
WORKER_ONLY = {"numba", "mpi4py", "gmsh"}
ONE_MODULE = {"mpi4py": "worker", "gmsh": "worker", "pyvista": "client", "numba": "worker"}
"""Libraries that only one module of one house may import."""
HEAVY = WORKER_ONLY | {"pyvista", "vtk", "vtkmodules"}
"""Libraries without which the contract, the client and the server run; only pictures need pyvista."""
TESTS = sorted((ROOT / "tests").rglob("*.py"))
SOURCES = sorted(path for house in HOUSES for path in (ROOT / house).rglob("*.py"))


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def imported(nodes: Iterator[ast.AST]) -> set[str]:
    """Returns the absolute names of the modules that the nodes import."""
    names: set[str] = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names.add(node.module or "")
    return names


def heads(path: Path) -> set[str]:
    return {name.partition(".")[0] for name in imported(ast.walk(tree(path)))}


def test_a_house_imports_only_itself_and_the_contract() -> None:
    for path in SOURCES:
        house = path.relative_to(ROOT).parts[0]
        allowed = set() if house == "cases" else {"cases"}
        for name in imported(ast.walk(tree(path))):
            parts = name.split(".")
            assert parts[0] not in HOUSES, f"{name_of(path)}: write conoid.{name}, or a relative import"
            if parts[0] == "conoid":
                assert len(parts) > 1, f"{name_of(path)}: import from a house, not from conoid"
                assert parts[1] in allowed, f"{name_of(path)}: {house} may not import {name}"


def test_no_process_imports_modules_from_its_working_folder() -> None:
    """Working folders belong to the user, and may have a module ``queue`` or ``conoid``: with -P Python ignores such
    modules.
    """
    started = re.compile(r'(?:executable,|\{python\}|bin/python) *"?(-\w+)')
    found = [(name_of(path), match[1]) for path in SOURCES for match in started.finditer(path.read_text("utf-8"))]
    found += [
        ("deploy/job.sh", match[1]) for match in started.finditer((ROOT / "deploy" / "job.sh").read_text("utf-8"))
    ]
    assert len(found) > 10
    assert [name for name, option in found if option != "-P"] == []


def test_relative_imports_stay_at_home() -> None:
    for path in SOURCES:
        depth = len(path.relative_to(ROOT).parts) - 1
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.ImportFrom):
                assert node.level <= depth, f"{name_of(path)}:{node.lineno}: this relative import leaves the house"


def test_helpers_of_tests_are_modules_of_their_own() -> None:
    """Code that two tests need is in a separate module, and not in a conftest, because a conftest contains fixtures."""
    for path in TESTS:
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.ImportFrom):
                names = [*(node.module or "").split("."), *(alias.name for alias in node.names if node.level)]
                for name in names:
                    assert not name.startswith("test_"), f"{name_of(path)}:{node.lineno}: {name} is a test"
                    assert name != "conftest", f"{name_of(path)}:{node.lineno}: fixtures need no import"


def test_tests_mirror_the_houses() -> None:
    folders = {path.name for path in (ROOT / "tests").iterdir() if path.is_dir() and path.name != "__pycache__"}
    inside = {path.name for path in (ROOT / "worker").iterdir() if path.is_dir()}
    assert set(HOUSES) <= folders
    assert folders - set(HOUSES) - inside == {"verification", "bench", "drill"}


def relatives(path: Path, nodes: Iterable[ast.AST] | None = None) -> set[Path]:
    """Returns the files of the same house that a file imports in the ``nodes``, or anywhere in the file."""
    found: set[Path] = set()
    for node in ast.walk(tree(path)) if nodes is None else nodes:
        if isinstance(node, ast.ImportFrom) and node.level:
            base = path.parents[node.level - 1].joinpath(*(node.module or "").split(".") if node.module else ())
            names = [base.joinpath(alias.name) for alias in node.names]
            found |= {place.with_suffix(".py") for place in (base, *names)}
    return found & set(SOURCES)


@pytest.mark.parametrize("house", HOUSES)
def test_no_imports_go_in_a_circle(house: str) -> None:
    """Imports inside functions, and imports of types only, also count."""
    left = {path: relatives(path) for path in SOURCES if name_of(path).startswith(f"{house}/")}
    while free := [path for path, needed in left.items() if not needed & left.keys()]:
        for path in free:
            del left[path]
    assert not left, f"circles among {sorted(map(name_of, left))}"


def is_a_choice(value: ast.expr) -> bool:
    """Returns True if a number was chosen, which means that the number is no layout of arrays (also in the types of
    kernels), numbering or ratio of integers.
    """
    words = {node.id for node in ast.walk(value) if isinstance(node, ast.Name)}
    numbers = [n.value for n in ast.walk(value) if isinstance(n, ast.Constant) and isinstance(n.value, int | float)]
    ratio = all(isinstance(node, ast.BinOp | ast.Div | ast.Constant | ast.Tuple | ast.Load) for node in ast.walk(value))
    return any(numbers) and not words & {"CHUNK", "range", "types"} and not (ratio and "/" in ast.unparse(value))


def test_a_numeric_constant_has_its_source() -> None:
    """The docstring below the constant, or below its group of constants, has the source, the measurement, or the remark
    that the value was chosen."""
    for path in SOURCES:
        explained, line = False, 0
        for node in reversed(tree(path).body):
            explained = isinstance(node, ast.Expr) or (
                explained and (isinstance(node, ast.Assign) and node.end_lineno == line - 1)
            )
            line = node.lineno
            if not isinstance(node, ast.Assign) or not is_a_choice(node.value) or isinstance(node.value, ast.Dict):
                continue
            if all(name.isupper() for name in ast.unparse(node.targets[0]).strip("()").replace("_", "").split(", ")):
                assert explained, f"{name_of(path)}:{node.lineno}: {ast.unparse(node)}"


PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
KNOWN = [f"/{name_of(path)}" for path in [*SOURCES, *TESTS]]
MODULE_IN_PROSE = re.compile(rf"`((?:{'|'.join(HOUSES)}|tests)(?:/\w+)+)`")
PATTERNS = {"cases/laws/NAME.py", "worker/materials/NAME.py", "server/routes/NAME.py", "tests/worker/test_NAME.py"}


def prose(path: Path) -> Iterator[str]:
    """Yields the text of a page, or of the comments and docstrings of a module."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        yield text
        return
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.value.value
    yield from re.findall("#.*", text)


def lost(text: str) -> list[str]:
    """Returns files of the source tree that a text names, by the end of their path, and that do not exist."""
    words = {word.strip(".") for word in re.split(r"[\s`'\"()\[\],;:#]+", text) if ".py" in word}
    files = {word for word in words if word.endswith(".py") and re.fullmatch(r"\w[\w/.-]*", word)} - PATTERNS
    modules = {name for name in MODULE_IN_PROSE.findall(text) if not (ROOT / name).is_dir()}
    named = files | {f"{name}.py" for name in modules}
    return sorted(name for name in named if not any(known.endswith(f"/{name}") for known in KNOWN))


def test_files_that_prose_names_are_there() -> None:
    found = {name_of(path): lost("\n".join(prose(path))) for path in [*SOURCES, *TESTS, *PAGES]}
    assert {path: names for path, names in found.items() if names} == {}


def test_names_of_files_that_are_not_there_are_found() -> None:
    assert lost("see fracture/bodies.py, fracture/stage.py and `worker/contact`, `worker/nothing`") == [
        "fracture/bodies.py", "worker/nothing.py"
    ]  # fmt: skip


def test_the_table_of_the_step_is_the_same_in_code_and_document() -> None:
    row = re.compile(r"^ ?(\d+)  (\S.*?)  +(\S.*)$", re.MULTILINE)
    code, document = ((ROOT / name).read_text(encoding="utf-8") for name in ("worker/step.py", "ARCHITECTURE.md"))
    lines = [found[:2] for found in row.findall(code)]
    assert [int(number) for number, _ in lines] == list(range(1, len(lines) + 1))
    assert lines == [found[:2] for found in row.findall(document)]


def test_the_tree_of_rooms_in_the_document_is_that_of_the_sources() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8").partition("## Rooms")[2].split("```")[1]
    for house in HOUSES:
        rooms = {path.name for path in (ROOT / house).iterdir() if path.is_dir() and path.name != "__pycache__"}
        (part,) = re.findall(rf"^{house}/\n((?:  .*\n)+)", text, re.MULTILINE)
        starts = [re.match(r"  ((?:\w+/,? )+)", line) for line in part.splitlines()]
        assert rooms == {name for start in starts if start for name in re.findall(r"(\w+)/", start[1])}, house


def test_the_contract_is_light() -> None:
    for path in SOURCES:
        if path.relative_to(ROOT).parts[0] == "cases":
            strangers = heads(path) - set(sys.stdlib_module_names) - CONTRACT
            assert not strangers, f"{name_of(path)} imports {strangers}"


def test_the_solver_stays_in_the_worker() -> None:
    for path in SOURCES:
        if path.relative_to(ROOT).parts[0] != "worker":
            assert not heads(path) & WORKER_ONLY, name_of(path)


@pytest.mark.parametrize(("library", "house"), ONE_MODULE.items())
def test_one_module_imports_it(library: str, house: str) -> None:
    users = [name_of(path) for path in SOURCES if library in heads(path)]
    assert len(users) <= 1, f"{library} is imported by {users}"
    assert all(user.startswith(f"{house}/") for user in users)


@pytest.mark.parametrize("house", HOUSES)
def test_one_module_of_a_house_imports_zenoh(house: str) -> None:
    users = [name_of(path) for path in SOURCES if name_of(path).startswith(f"{house}/") and "zenoh" in heads(path)]
    assert len(users) <= 1, f"zenoh is imported by {users}"


@pytest.mark.parametrize("house", ["cases", "client", "server"])
def test_importing_a_house_loads_no_solver(house: str) -> None:
    """The contract, the client and the server work if MPI, numba and VTK are not installed."""
    light = [path for path in SOURCES if name_of(path).startswith(f"{house}/") and not is_heavy(path)]
    modules = [module_of(path) for path in light if path.name != "__main__.py"]
    code = f"""
import importlib, sys
for absent in {sorted(HEAVY)!r}:
    sys.modules[absent] = None
for module in {modules!r}:
    importlib.import_module(module)
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 0, ended.stderr


@cache
def is_heavy(path: Path) -> bool:
    """Returns True if the import of a module needs VTK, a library of the worker, or another module that needs VTK or
    such a library.
    """
    at_import = [node for node in tree(path).body if isinstance(node, ast.ImportFrom)]
    return bool(heads(path) & HEAVY) or any(is_heavy(file) for file in relatives(path, at_import))


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(("conoid", *(part for part in parts if part != "__init__")))


@cache
def project() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def test_every_package_is_shipped() -> None:
    listed = set(project()["tool"]["setuptools"]["packages"])
    found = {module_of(path) for path in SOURCES if path.name == "__init__.py"}
    homes = {module_of(path.parent / "__init__.py") for path in SOURCES}
    assert listed == found == homes


FILES = [path for house in HOUSES for path in (ROOT / house).rglob("*") if path.is_file()]
DATA = [path for path in FILES if path.suffix != ".py" and "__pycache__" not in path.parts]
"""Files of packages that are no modules."""


def test_every_file_of_a_package_is_shipped() -> None:
    tables = project()["tool"]["setuptools"]["package-data"]
    for path in DATA:
        package = next(p for p in path.parents if (p / "__init__.py").exists())
        patterns = [*tables["*"], *tables.get(module_of(package / "__init__.py"), [])]
        assert any(path.relative_to(package).match(pattern) for pattern in patterns), f"{name_of(path)} is not shipped"


def requirements() -> dict[str, Requirement]:
    """Returns the direct dependencies of every extra except ``peers``, whose package is used for comparison only."""
    extras = project()["project"]["optional-dependencies"]
    texts = [*project()["project"]["dependencies"], *(t for name in extras if name != "peers" for t in extras[name])]
    found = {requirement.name: requirement for requirement in map(Requirement, texts)}
    return {name: requirement for name, requirement in found.items() if name != "conoid"}


def locked() -> dict[str, Version]:
    lines = (ROOT / "requirements.lock").read_text(encoding="utf-8").splitlines()
    pins = [line.split("==") for line in lines if line and not line.startswith("#")]
    return {name: Version(version) for name, version in pins}


@pytest.mark.parametrize("name", sorted(requirements()))
def test_a_direct_dependency_is_locked_and_has_its_reason(name: str) -> None:
    assert locked()[name] in requirements()[name].specifier
    assert re.search(rf"\b{re.escape(name)}\b", (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")), name


# The same answer on every processor

BLURRED = {
    "exp", "expm1", "log", "log1p", "log2", "log10", "pow", "power", "cbrt", "hypot", "sin", "cos", "tan", "arcsin",
    "arccos", "arctan", "arctan2", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "einsum", "dot", "matmul",
    "inner", "tensordot", "inv", "det", "solve", "eigh", "eigvalsh", "svd",
}  # fmt: skip
"""Functions of numpy and math whose last bit depends on the processor or on the C library: exponentials and similar
functions, and functions that fuse or reorder sums of products."""
TELLS = {
    "worker/contact/checks/common_volume.py", "worker/contact/checks/inside.py", "worker/contact/checks/overlap.py",
    "worker/fracture/fragments.py", "worker/gauges/penetration.py", "worker/gauges/reference.py",
    "worker/gauges/shapes.py", "worker/migration/groups.py", "worker/migration/meter.py", "worker/output/fields.py",
    "worker/output/frames.py", "worker/run/job.py", "worker/snapshots/decimate.py", "worker/snapshots/invariants.py",
    "worker/snapshots/table.py",
}  # fmt: skip
"""Files that only report, refuse or balance. No result depends on the files that only report, refuse or balance, except
for parts that are pushed apart at the start (docs/theory/sums.md)."""
POWERS_OF_TWO, REFUSES, WINDS = "worker/mesh/occ/frame.py", "worker/mesh/frame.py", "worker/mesh/occ/shells.py"
"""Files with a rounded scale; files with a size in a message; files with the rounded winding number of a surface round
a point."""


def blurred(path: Path) -> set[str]:
    """Returns lines that call a function whose last bit depends on the processor, multiply matrices, or raise to a
    power that is no integer.
    """
    found = set()
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            module, name = ast.unparse(node.func.value), node.func.attr
            alone = name == "norm" and not any(word.arg == "axis" for word in node.keywords)
            if module in ("np", "math", "np.linalg") and (name in BLURRED or alone):
                found.add(f"{name_of(path)}:{node.lineno}: {module}.{name}")
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult):
            found.add(f"{name_of(path)}:{node.lineno}: @")
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            power = node.right.value if isinstance(node.right, ast.Constant) else None
            two = isinstance(node.left, ast.Constant) and node.left.value == 2
            if not (isinstance(power, int) or (two and power is None)):
                found.add(f"{name_of(path)}:{node.lineno}: {ast.unparse(node)}")
    return found


def test_inputs_of_the_answer_have_the_same_bits_on_every_processor() -> None:
    """Kernels use worker/materials/elementary.py and worker/materials/turning.py, and write sums of products as
    sums.
    """
    for path in (path for path in SOURCES if name_of(path).startswith("worker/")):
        if name_of(path) not in TELLS | {POWERS_OF_TWO, REFUSES, WINDS}:
            assert not blurred(path)


def test_the_functions_that_may_not_be_called_are_found() -> None:
    assert all(blurred(ROOT / name) for name in TELLS | {POWERS_OF_TWO, REFUSES, WINDS})
