"""Fracture in the time step: which facets break, what separates, and what that changes everywhere else.

At the end of a step, with the stress of n+1 at hand: facets that pass the criterion break; nodes whose star has come
apart become copies; the forces that the tets of a copy have given to its parent are handed over, in integers; and
everybody who keeps something by node takes up the copies. In ``cohesive`` parts a facet keeps its traction when it
breaks and gives it up with the opening.
"""

import logging
from dataclasses import dataclass

import numpy as np

from conoid.cases.library import material as find_material
from conoid.cases.schema import Case
from conoid.cases.schema import Fracture as Spec

from ..boundaries import Boundary
from ..clock import Clock
from ..contact.stage import Contact
from ..elements.forms import Elements
from ..mesh.faces import FACES
from ..migration.parcel import Parcel
from ..parallel.comm import Comm
from ..parallel.fixed_point import exact_sums
from ..parallel.ownership import Neighbour, complete
from ..state import MASS, Flags, Floats, Indices, Ints, Model
from ..topology import Split
from . import bodies, nodal
from .bodies import Body, Far, Loaded
from .cohesive import Cohesion, Facets, inserted
from .order import strongest
from .release import Release
from .separation import Broken, Separation
from .strength import Toughness, toughness

_TAG = 16
_LEAST = 0.05
"""Of the square of the highest frequency that a step resolves: what cohesive facets may use at least."""
_SHARES = 24.0
"""A node has a quarter of its tet's mass, up to three of whose faces open there, between two nodes that move."""
_RESOLVED = 1.0 / 3.0
"""Elements to a cohesive zone, at most, for its energy to be that of the law."""
_STEP = 6.0**-0.5
"""Stable step of a regular tet times the speed of sound, over its edge."""
_REGULAR = (6.0 * 2.0**0.5) ** (1.0 / 3.0)
"""Edge of a regular tet over the cube root of its volume."""

log = logging.getLogger("conoid.worker")


@dataclass
class Breaking:
    """Facets of one body that break in a step."""

    body: Body
    tets: Ints
    """(m, 2) global ids of the tets of either side, the smaller first."""
    nodes: Indices
    """(m, 3) local nodes, counter-clockwise seen from outside of the first side."""
    sides: Indices
    """(m, 2, 3) block, place and face of either side, -1 for one of another rank."""
    first: Flags
    """(m,) whether the first side is here."""
    traction: Floats
    """(m, 4) on the outward normal of the first side, and the effective one, Pa."""
    mass: Floats
    """(m,) of the lighter tet, kg."""

    @property
    def ids(self) -> Ints:
        """(m,) of the facets."""
        at = np.where(self.sides[:, 0, 1] >= 0, 0, 1)
        side = self.sides[np.arange(len(at)), at]
        return bodies.facet_ids(self.body.block, side[:, 1], side[:, 2])

    @property
    def broken(self) -> Broken:
        """All sides that are here."""
        sides = self.sides.reshape(-1, 3)
        sides = sides[sides[:, 1] >= 0]
        return Broken(sides[:, 1], sides[:, 2])

    def load(self, x0: Floats) -> Floats:
        """(m,) effective traction over strength."""
        sides = self.sides[:, 0].copy()
        sides[sides[:, 1] < 0] = self.sides[sides[:, 1] < 0, 1]
        area = bodies.areas(self.body.block.tets, sides[:, 1], sides[:, 2], x0)
        return np.asarray(self.traction[:, 3] / self.body.tough.strengths(self.ids, area))

    def take(self, chosen: Flags) -> "Breaking":
        """Some of the facets."""
        return Breaking(
            self.body, self.tets[chosen], self.nodes[chosen], self.sides[chosen], self.first[chosen],
            self.traction[chosen], self.mass[chosen],
        )  # fmt: skip


class Fracture:
    """The fracture of a case on one rank."""

    def __init__(
        self, case: Case, model: Model, neighbours: list[Neighbour], elements: Elements, boundaries: list[Boundary],
        contact: Contact | None, comm: Comm, clock: Clock,
    ) -> None:  # fmt: skip
        """All ranks take part."""
        self._model, self._neighbours, self._elements = model, neighbours, elements
        self._boundaries, self._contact = boundaries, contact
        self._comm, self._clock = comm, clock
        specs = [part.fracture for part in case.parts if part.fracture is not None]
        self._smooth = any(spec.traction == "nodes" for spec in specs)
        self._one_by_one = any(spec.order == "local_maximum" for spec in specs)
        self._unused = max(1.0 - case.numerics.dt_safety**2, _LEAST)
        self._bodies: list[Body] = []
        self.warnings: list[str] = []
        """What the user should know of the mesh."""
        work = 0.0
        for index, part in enumerate(case.parts):
            if part.fracture is not None:
                volume, size = _tet(model, index, find_material(case, part.material).density, comm)
                tough = toughness(find_material(case, part.material), part.fracture, size)
                work = max(work, tough.energy * volume ** (2.0 / 3.0))
                step = case.numerics.dt_safety * _STEP * size / tough.speed
                self.warnings += _warnings(part.name, part.fracture, tough, size, step)
                self._bodies += [
                    bodies.arm(i, block, part.fracture, tough, model.nodes.x0)
                    for i, block in enumerate(model.blocks) if block.part == index
                ]  # fmt: skip
        heaviest = np.zeros(len(case.parts))
        for body in self._bodies:
            heaviest[body.block.part] = body.block.row(MASS).max(initial=0.0)
        self._heaviest = comm.maximum(heaviest)
        """(parts,) mass of the heaviest tet of all ranks, kg; 0 where a part does not fracture."""
        self._far = Far(self._bodies, neighbours, comm)
        self._separation = Separation(model, neighbours, comm)
        self._since: tuple[Ints, Floats] = (np.zeros(0, np.int64), np.zeros(0))
        """Ids, ascending, of the facets beyond their strength, and since when, s."""
        self.broken = 0
        """Facets of all ranks that have broken."""
        self._longest = 0.0
        self.cohesion: Cohesion | None = None
        if any(spec.model == "cohesive" for spec in specs):
            self.cohesion = elements.cohesion = Cohesion(work)
            self._release = Release(self.cohesion, model.nodes, neighbours, comm)

    def advance(self) -> None:
        """Breaks what the stress of the present has overcome; all ranks take part."""
        self._longest = max(self._longest, self._clock.stable)
        near, far = self.loaded()
        passed: list[tuple[Ints, Floats]] = []
        found = [
            self._beyond(body, loaded, remote, passed)
            for body, loaded, (remote, _) in zip(self._bodies, near, far, strict=True)
        ]
        ids = np.concatenate([np.zeros(0, np.int64), *(ids for ids, _ in passed)])
        order = np.argsort(ids)
        self._since = ids[order], np.concatenate([np.zeros(0), *(since for _, since in passed)])[order]
        firsts = [self._far.first[at[across]] for (_, at), (_, across) in zip(far, found, strict=True)]
        sides = sum(len(within) + len(across) for within, across in found)
        facets = sum(len(within) + int(first.sum()) for (within, _), first in zip(found, firsts, strict=True))
        sides, facets = self._comm.sum(np.array([sides, facets]))
        if not sides:
            return
        broken = []
        for body, loaded, (remote, at), (within, across), first in zip(
            self._bodies, near, far, found, firsts, strict=True
        ):
            if len(within) or len(across):
                mass = self._far.mass[at[across]]
                broken.append(_breaking(body, loaded.take(within), remote.take(across), first, mass))
        if self._one_by_one:
            broken = self._strongest(broken)
            facets = self._comm.sum(np.array([sum(int(b.first.sum()) for b in broken)]))[0]
        if facets:
            self.broken += int(facets)
            self._break(broken)

    def keep(self, parcel: Parcel) -> None:
        """Adds what fracture must remember to a parcel."""
        parcel.known["fracture"] = self.broken, self._longest
        facet, since = self._since
        tets, rows = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
        for body in self._bodies:
            of, tet = bodies.sides_of(body.block, facet)
            rows.append(of)
            tets.append(tet)
        every = np.concatenate(rows)
        parcel.rows["fracture.since"] = {"tet": np.concatenate(tets), "key": facet[every], "since": since[every]}
        if self.cohesion is not None:
            self.cohesion.keep(parcel)

    def resume(self, parcel: Parcel) -> None:
        """Takes it back."""
        self.broken, self._longest = parcel.known["fracture"]
        table = parcel.rows["fracture.since"]
        self._since = table["key"], table["since"]
        if self.cohesion is not None:
            self.cohesion.resume(parcel, self._model.nodes)

    def loaded(self) -> tuple[list[Loaded], list[tuple[Loaded, Ints]]]:
        """Of every body the facets within this rank that may pass, and those shared with another, with their places
        among all such; all ranks take part.
        """
        nodes = self._model.nodes
        near = [bodies.look(body, nodes.x) for body in self._bodies]
        far = self._far.look(nodes.x)
        if not self._smooth:
            return near, far
        some = [k for k, body in enumerate(self._bodies) if body.spec.traction == "nodes"]
        chosen = [(self._bodies[k], self._separation.stars[self._bodies[k].index]) for k in some]
        wanted = np.zeros(nodes.n, bool)
        for k in some:
            wanted[self._bodies[k].block.tets[near[k].places]] = True
        stress = nodal.stresses(chosen, wanted, nodes, self._heaviest, self._neighbours, self._comm)
        for k, (body, _) in zip(some, chosen, strict=True):
            remote, at = far[k]
            nodal.replace(near[k], np.ones(len(near[k].places), bool), body, stress, nodes.x)
            nodal.replace(remote, self._far.first[at], body, stress, nodes.x)
        return near, far

    def rest(self) -> None:
        """Nothing is beyond its strength: no clock runs."""
        self._since = np.zeros(0, np.int64), np.zeros(0)

    def let_go(self) -> None:
        """Before the forces of the present act: cohesive facets give up what they would not be paid for; all ranks
        take part.
        """
        if self.cohesion is not None and self.broken:
            self._release.apply(self._clock)

    def free(self) -> None:
        """Gives the messages back to MPI."""
        self._far.free()
        if self.cohesion is not None:
            self._release.free()

    def _beyond(
        self, body: Body, near: Loaded, far: Loaded, passed: list[tuple[Ints, Floats]]
    ) -> tuple["np.ndarray", "np.ndarray"]:
        """Which facets break; notes those beyond their strength with their clocks in ``passed``."""
        if not len(near.places) and not len(far.places):
            return far.places, far.places
        block = body.block
        places, faces = np.concatenate([near.places, far.places]), np.concatenate([near.faces, far.faces])
        ids = bodies.facet_ids(block, places, faces)
        strength = body.tough.strengths(ids, bodies.areas(block.tets, places, faces, self._model.nodes.x0))
        effective = np.concatenate([near.traction[:, 3], far.traction[:, 3]])
        since, now = np.full(len(ids), self._clock.t), self._clock.t
        known, times = self._since
        if len(known):
            at = np.minimum(np.searchsorted(known, ids), len(known) - 1)
            since = np.where(known[at] == ids, times[at], since)
        over = effective >= strength
        breaks = over & (effective >= body.tough.required(strength, now - since))
        passed.append((ids[over], since[over]))
        return np.flatnonzero(breaks[: len(near.places)]), np.flatnonzero(breaks[len(near.places) :])

    def _strongest(self, broken: list[Breaking]) -> list[Breaking]:
        """Those that are loaded most strongly round all of their nodes, where the part asks for that."""
        waiting = [b for b in broken if b.body.spec.order == "local_maximum"]
        none = np.zeros(0, np.int64)
        chosen = strongest(
            np.concatenate([none, *(b.ids for b in waiting)]),
            np.concatenate([np.zeros(0), *(b.load(self._model.nodes.x0) for b in waiting)]),
            np.concatenate([np.zeros((0, 3), np.int32), *(b.nodes for b in waiting)]),
            self._model.nodes.id, self._neighbours, self._comm,
        )  # fmt: skip
        ends = iter(np.split(chosen, np.cumsum([len(b.first) for b in waiting])))
        return [b.take(next(ends)) if b.body.spec.order == "local_maximum" else b for b in broken]

    def _break(self, broken: list[Breaking]) -> None:
        split = self._separation.break_facets({b.body.index: b.broken for b in broken})
        fresh = [self._insert(b.take(b.first), split) for b in broken if b.body.spec.model == "cohesive"]
        if split is not None and split.copies.n:
            self._tell_everybody(split)
            self._hand_over(split, fresh)
        for facets in fresh:
            assert self.cohesion is not None
            self.cohesion.insert(facets)
        if self._contact is not None:
            for b in broken:
                self._contact.crack(b.tets, b.nodes, b.sides)
            if split is not None:
                self._contact.separate(split)

    def _insert(self, b: Breaking, split: Split | None) -> Facets:
        """The new cohesive facets of a body."""
        nodes, block = self._model.nodes, b.body.block
        before = np.concatenate([b.nodes, b.nodes], axis=1)
        after = before if split is None else split.followed_sides(before, nodes.id, b.tets)
        size = bodies.areas(block.tets, b.sides[:, 0, 1], b.sides[:, 0, 2], nodes.x)
        frequency = 4.0 * self._unused / self._longest**2
        m, stiffness = len(size), 3.0 * b.mass / _SHARES * frequency / size
        return inserted(
            nodes, before, after, b.tets, b.traction[:, :3], b.traction[:, 3],
            np.full(m, b.body.tough.energy), np.full(m, block.shear_weight), stiffness, size,
        )  # fmt: skip

    def _tell_everybody(self, split: Split) -> None:
        self._elements.grow(split.copies)
        for boundary in self._boundaries:
            boundary.grow(split, self._model.nodes.id)

    def _hand_over(self, split: Split, fresh: list[Facets]) -> None:
        """Forces of the present, of the tets and cohesive facets of copies, from their parents to them."""
        nodes, copies = self._model.nodes, split.copies
        some = np.unique(np.concatenate([copies.parents, split.first + np.arange(copies.n)]))
        change = np.zeros((len(some), 3), np.int64)
        for b in np.unique(split.block[split.place >= 0]):
            rows = np.flatnonzero((split.block == b) & (split.place >= 0))
            tets, at = np.unique(split.place[rows].astype(np.int64), return_inverse=True)
            force = self._elements.forces_of(self._model.blocks[b], tets, nodes.scale)[at, split.corner[rows]]
            copy = split.node[rows]
            np.add.at(change, np.searchsorted(some, copy), force)
            np.subtract.at(change, np.searchsorted(some, copies.parents[copy - split.first]), force)
        if self.cohesion is not None:
            facets = self.cohesion.facets
            moved = np.isin(facets.nodes, copies.parents).any(axis=1)
            old = facets.nodes[moved]
            now = split.followed_sides(old, nodes.id, facets.tets[moved])
            facets.nodes[moved] = now
            self._scatter(change, some, old, facets.pull[moved], -1)
            self._scatter(change, some, now, facets.pull[moved], 1)
            for facets in fresh:
                self._scatter(change, some, facets.nodes, facets.pull, 1)
        complete(self._comm, self._among(some), change, _TAG)
        nodes.force[some] += change

    def _among(self, some: Ints) -> list[Neighbour]:
        """Who shares which of ``some`` nodes, by their places in it; who shares none is left out."""
        flags, found = np.zeros(self._model.nodes.n, bool), []
        for other in self._neighbours:
            flags[other.nodes] = True
            if (shared := flags[some]).any():
                found.append(Neighbour(other.rank, np.flatnonzero(shared).astype(np.int32)))
            flags[other.nodes] = False
        return found

    def _scatter(self, change: Ints, some: Ints, nodes: Indices, pull: Floats, sign: int) -> None:
        """Adds the forces on facets ``nodes`` (m, 6) to those nodes that are among ``some``; on others they cancel."""
        if not len(some):
            return
        force = sign * np.rint(pull * self._model.nodes.scale).astype(np.int64)
        for k in range(6):
            at = np.minimum(np.searchsorted(some, nodes[:, k]), len(some) - 1)
            here = some[at] == nodes[:, k]
            np.add.at(change, at[here], force[here, k % 3] * (1 if k < 3 else -1))


def _tet(model: Model, part: int, density: float, comm: Comm) -> tuple[float, float]:
    """Mean volume of the tets of a part, m^3, and the edge of a regular tet of that volume, m; all ranks take part."""
    masses = np.concatenate([np.zeros(0), *(block.row(MASS) for block in model.blocks if block.part == part)])
    mass, count = exact_sums(comm, np.column_stack([masses, np.ones(len(masses))]))
    volume = float(mass / count) / density
    return volume, _REGULAR * volume ** (1.0 / 3.0)


def _warnings(part: str, spec: Spec, tough: Toughness, size: float, step: float) -> list[str]:
    """What to know of a part with tets of edge ``size``, m, and a stable step of about ``step``, s, before it runs."""
    ratio, told = size / tough.zone, []
    log.info(
        "%s breaks at %.4g MPa with %.4g J/m^2: cohesive zone %.3g mm, elements %.3g mm, %.3g to 1",
        part, tough.strength * 1e-6, tough.energy, tough.zone * 1e3, size * 1e3, ratio,
    )  # fmt: skip
    if ratio > _RESOLVED:
        told.append(
            f"{part}: elements of {size * 1e3:.3g} mm in a cohesive zone of {tough.zone * 1e3:.3g} mm, "
            f"{ratio:.3g} to 1, resolved below {_RESOLVED:.2g}: the mesh decides on the energy of fracture; "
            "fracture.resolve = 'strength' keeps it and lowers the strength"
        )
    opening = tough.strength * step / tough.impedance
    if spec.model == "cohesive" and opening > tough.critical:
        told.append(
            f"{part}: a facet opens by {opening * 1e6:.3g} um in a step of {step * 1e9:.3g} ns, and by "
            f"{tough.critical * 1e6:.3g} um altogether: no law can be followed; use fracture.model = 'instant', "
            f"fracture.resolve = 'strength', or numerics.dt_safety {opening / tough.critical:.0f} times smaller"
        )
    return told


def _breaking(body: Body, near: Loaded, far: Loaded, first: Flags, mass: Floats) -> Breaking:
    """Facets that break: those within this rank, and ``far`` ones, with whether their ``first`` side is here and the
    ``mass`` of the tet on the other rank.
    """
    block, n = body.block, len(near.places)
    there = body.beside[near.places, near.faces]
    back = block.across[near.places, near.faces] % 4
    own = np.stack([_side(body, near.places, near.faces), _side(body, there, back)], axis=1)
    alone = _side(body, far.places, far.faces)
    none = np.full_like(alone, -1)
    flags = first[:, None, None]
    sides = np.concatenate([own, np.where(flags, np.stack([alone, none], axis=1), np.stack([none, alone], axis=1))])
    places, faces = np.concatenate([near.places, far.places]), np.concatenate([near.faces, far.faces])
    ids = np.column_stack([block.id[places], block.across[places, faces] // 4])
    corners = block.tets[places[:, None], FACES[faces]].astype(np.int32)
    corners[n:] = np.where(first[:, None], corners[n:], corners[n:][:, [0, 2, 1]])
    return Breaking(
        body=body, tets=np.sort(ids, axis=1).astype(np.int64), nodes=corners, sides=sides,
        first=np.concatenate([np.ones(n, bool), first]), traction=np.concatenate([near.traction, far.traction]),
        mass=np.minimum(block.at(MASS, places), np.concatenate([block.at(MASS, there), mass])),
    )  # fmt: skip


def _side(body: Body, places: "np.ndarray", faces: "np.ndarray") -> Indices:
    """(m, 3) block, place and face."""
    return np.column_stack([np.full(len(places), body.index), places, faces]).astype(np.int32)
