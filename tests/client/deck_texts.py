"""Small decks of three codes with one tet, a given material, a velocity and an end time."""

from pathlib import Path
from typing import Any

from conoid.cases.model.materials import Material
from conoid.client.decks.importing import Imported, read_deck
from conoid.client.decks.toml import bare

FOLDER = Path(__file__).parent / "decks"
DECKS = (
    "lspp_taylor.k", "lspp_plate.k", "lspp_ceramic.k", "hypermesh_bar.k", "ansa_drop.k", "hypermesh_rod_0000.rad",
    "ansa_punch_0000.rad", "cae_taylor.inp", "cae_impact.inp", "hypermesh_sandwich.inp",
)  # fmt: skip


def row(*values: object) -> str:
    """Returns a card of an LS-DYNA deck with fields of 10 columns."""
    return "".join(f"{value:>10}" for value in values)


STEEL = ("*MAT_ELASTIC", row(1, "7.85E-9", 210000.0, 0.3))
"""Elastic steel as a card of LS-DYNA, in mm, t, s."""


def r20(*values: object) -> str:
    """Returns a line of a Radioss deck with fields of 20 columns."""
    return "".join(f"{value:>20}" for value in values)


def lsdyna(*keywords: str, mid: int = 1, eos: int = 0) -> str:
    """Returns an LS-DYNA deck with one tet of the material ``mid``."""
    nodes = "\n".join(f"{i:8}{x:16.3f}{y:16.3f}{z:16.3f}" for i, (x, y, z) in enumerate(_CORNERS, 1))
    return "\n".join((
        "*KEYWORD", "*CONTROL_TERMINATION", row(0.01), "*PART", "body", row(1, 1, mid, eos), "*SECTION_SOLID",
        row(1, 10), "*NODE", nodes, "*ELEMENT_SOLID", "".join(f"{n:8}" for n in (1, 1, 1, 2, 3, 4, 4, 4, 4, 4)),
        *keywords, "*END", "",
    ))  # fmt: skip


def abaqus(material: str, step: str = "", model: str = "", dynamic: str = "*Dynamic, Explicit") -> str:
    """Returns an Abaqus input file with one tet of the material ``M``."""
    nodes = "\n".join(f"{i}, {x}, {y}, {z}" for i, (x, y, z) in enumerate(_CORNERS, 1))
    return (
        f"*Heading\nbody\n*Node, nset=all\n{nodes}\n*Element, type=C3D4, elset=body\n1, 1, 2, 3, 4\n"
        f"*Solid Section, elset=body, material=M\n,\n*Material, name=M\n{material}\n{model}\n*Step\n{dynamic}\n, 1e-5\n"
        f"{step}\n*End Step\n"
    )


def radioss(*options: str) -> str:
    """Returns a Radioss starter deck with one tet of the material 1, in mm, Mg, s."""
    nodes = "\n".join(f"{i:10}{x:20.3f}{y:20.3f}{z:20.3f}" for i, (x, y, z) in enumerate(_CORNERS, 1))
    units = r20("Mg", "mm", "s")
    return "\n".join((
        "#RADIOSS STARTER", "/BEGIN", "body", row(2021, 0), units, units, "/PART/1", "body", row(1, 1), "/NODE", nodes,
        "/TETRA4/1", row(1, 1, 2, 3, 4), *options, "/RUN/body/1", "1e-5", "/END", "",
    ))  # fmt: skip


_CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def read(folder: Path, name: str, text: str, units: str | None = "mm,t,s") -> Imported:
    """Imports a deck as a case."""
    (folder / name).write_text(text, encoding="utf-8")
    return read_deck(folder / name, units)


def material(found: Imported) -> Material:
    """Returns the only material of the case as a model."""
    (made,) = found.data["materials"].values()
    return Material.model_validate(bare(made))


def part(found: Imported) -> Any:
    """Returns the first part of the case as plain data."""
    return bare(found.data["parts"][0])


INSTANCES = (
    "*Part, name=P\n*Node\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n"
    "*Element, type=C3D4, elset=All\n1, 1, 2, 3, 4\n"
    "*Solid Section, elset=All, material=M\n,\n*End Part\n*Assembly, name=A\n*Instance, name=one, part=P\n"
    "*End Instance\n*Instance, name=two, part=P\n0, 0, 5\n*End Instance\n{sets}*End Assembly\n"
    "*Material, name=M\n*Density\n7.85e-9,\n"
    "*Elastic\n2.1e5, 0.3\n*Step\n*Dynamic, Explicit\n, 1e-5\n*End Step\n"
)
"""Abaqus input file with two instances of a part of one tet, and a place for sets of the assembly."""
