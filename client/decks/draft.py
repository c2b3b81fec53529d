"""Case made from a deck, as plain data; comments give the origin of its keys."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .account import Account, Entry
from .naming import Names, name
from .toml import NOTE
from .units import LENGTH, Dimension, System

_MOST_FRAMES = 100_000
"""Largest number of frames of a run (cases/model/run.py)."""


@dataclass
class Made:
    """A material of a deck after conversion to keys of a case."""

    material: dict[str, Any]
    """Keys below ``[materials.NAME]``; empty if Conoid lacks the material law."""
    erosion: dict[str, Any] = field(default_factory=dict)
    """Criteria of the material for the deletion of tets. In Conoid these criteria are keys of the part."""
    rigid: bool = False
    temperature: str | float | None = None
    """Initial temperature of the part that has the material."""
    held: str = ""
    """Axes along which a rigid body is fixed; a fixed rigid body does not rotate either."""


@dataclass
class Body:
    """A part of a deck that becomes a part of the case."""

    key: str
    """Key of the part in the deck."""
    title: str
    material: str
    """Key of the material of the part in the deck."""
    group: str | None
    """Value of ``mesh.group`` in the case; None if the part is the whole file."""
    entry: Entry
    velocity: tuple[float, float, float] | None = None
    """Initial velocity of the part in units of the deck."""
    spin: dict[str, Any] | None = None
    erosion: dict[str, Any] = field(default_factory=dict)
    temperature: str | float | None = None
    rigid: bool = False
    name: str = ""
    """Name of the part in the case."""


class Draft:
    """Tables of a case, which the import fills keyword by keyword."""

    def __init__(self, deck: Path, system: System, account: Account) -> None:
        """Makes an empty case. ``deck``: the file with the mesh of the parts."""
        self.deck = deck
        self.system = system
        self.account = account
        self.name = name(deck.stem) or "deck"
        self.title = ""
        self.materials: dict[str, dict[str, Any]] = {}
        self.parts: list[dict[str, Any]] = []
        self.boundaries: list[dict[str, Any]] = []
        self.bonds: list[dict[str, Any]] = []
        self.contact: dict[str, Any] | None = None
        self.numerics: dict[str, Any] = {}
        self.run: dict[str, Any] = {}
        self.missing: list[str] = []
        """Keys that the case lacks and the user must write."""
        self._names, self._made = Names(), dict[str, tuple[str, Made]]()
        self._rigid: list[tuple[str, str]] = []

    def quantity(self, value: float, dimension: Dimension) -> str | float:
        """Returns a number of the deck with its unit."""
        return self.system.quantity(value, dimension)

    def vector(self, values: tuple[float, ...] | list[float], dimension: Dimension) -> list[str | float]:
        """Returns three numbers of the deck with their unit."""
        return [self.quantity(value, dimension) for value in values]

    # Materials and parts ----------------------------------------------------------------------------------------------

    def add_material(self, key: str, title: str, made: Made, entry: Entry) -> None:
        """Adds a material to the case. A material without keys is only a name, which the case does not define."""
        found = self._names.give(title, "material", key)
        if made.material:
            self.materials[found] = {NOTE: [f"{entry.keyword}, {entry.place}"], **made.material}
            entry.take(f"materials.{found}")
        self._made[key] = found, made

    def material_of(self, key: str) -> tuple[str, Made] | None:
        """Returns the name and the constants of a material of the deck; None if it was not translated."""
        return self._made.get(key)

    def call(self, bodies: Sequence[Body], solid: Iterable[str]) -> Names:
        """Gives the bodies names in the case. Refuses the import if a part with elements in ``solid`` is not
        defined.
        """
        self.account.without(solid, [body.key for body in bodies])
        names = Names()
        for body in bodies:
            body.name = names.give(body.title, "part", body.key)
        return names

    def add_part(self, body: Body, names: Names) -> None:
        """Adds the part of the case that corresponds to a part of the deck."""
        body.name = body.name or names.give(body.title, "part", body.key)
        found = self._made.get(body.material)
        if found is None:
            body.entry.refuse(f"its material {body.material!r} is not defined in the deck")
            found = "undefined", Made({})
        material, made = found
        part: dict[str, Any] = {NOTE: [f"{body.entry.keyword}, {body.entry.place}"], "name": body.name}
        part["material"] = material
        part["mesh"] = {"shape": "file", "path": self.deck.name, "unit": self.quantity(1.0, LENGTH)}
        if body.group is not None:
            part["mesh"]["group"] = body.group
        if body.velocity is not None and any(body.velocity):
            part["velocity"] = self.vector(body.velocity, (1, 0, -1, 0))
        if body.spin is not None:
            part["spin"] = body.spin
        temperature = made.temperature if body.temperature is None else body.temperature
        if temperature is not None:
            part["temperature"] = temperature
        erosion = {**made.erosion, **body.erosion}
        if made.rigid or body.rigid:
            part["rigid"] = True
            self._rigid.append((body.key, body.name))
            if erosion:
                body.entry.remark("left", "failure of the material", "a rigid part has no strain")
        elif erosion:
            part["erosion"] = erosion
        body.entry.take(f"parts[{len(self.parts)}]")
        self.parts.append(part)

    def rigid_parts(self) -> list[tuple[str, str]]:
        """Returns key and name of each rigid part."""
        return self._rigid

    def set_frames(self, count: float, interval: float, end: float, entry: Entry) -> int:
        """Sets ``run.frames`` from a number of frames, or from an interval in the time unit of the deck. Returns the
        number of frames; 0 if the deck gives none.
        """
        frames = count if count > 0.0 else end / interval if interval > 0.0 and math.isfinite(end) else 0.0
        if not 0.5 <= frames <= _MOST_FRAMES:
            entry.leave(f"the number of frames is not between 1 and {_MOST_FRAMES:,}; run.frames is set to 20")
            return 0
        self.run["frames"] = round(frames)
        entry.take("run.frames")
        return round(frames)

    # Other keys
    # --------------------------------------------------------------------------------------------------------

    def add_boundary(self, table: dict[str, Any], *entries: Entry) -> str:
        """Adds a boundary and the keywords from which it was made; returns its index in the case."""
        place = f"boundaries[{len(self.boundaries)}]"
        note = ", ".join(dict.fromkeys(f"{each.keyword} ({each.place})" for each in entries))
        self.boundaries.append({NOTE: [note], **table})
        for each in entries:
            each.take(place)
        return place

    def data(self) -> dict[str, Any]:
        """Returns the case as plain data with comments."""
        case: dict[str, Any] = {"name": self.name}
        if self.title:
            case["title"] = self.title[:200]
        if self.materials:
            case["materials"] = self.materials
        case["parts"] = self.parts
        if self.bonds:
            case["bond"] = self.bonds
        if self.boundaries:
            case["boundaries"] = self.boundaries
        case["contact"] = "none" if self.contact is None else self.contact
        if self.numerics:
            case["numerics"] = self.numerics
        case["run"] = self.run
        return case
