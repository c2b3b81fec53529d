"""Surface, cracks and node normals of a rank. The module also updates the surface, the cracks and the normals."""

import numpy as np

from ..boundaries.boundaries import FREE, Boundary
from ..errors import InputError
from ..kernels.jit import njit
from ..migration.parcel import Parcel
from ..model.columns import COPIED
from ..model.ids import among
from ..model.state import Block, Flags, Floats, Ints, Model, Nodes
from ..model.topology import Split
from ..parallel.comm import Comm
from ..parallel.ownership import Neighbour
from ..parallel.team import Team
from .narrow_phase.cracks import Cracks
from .scene.scene import Scene
from .scene.surface_motion import SurfaceMotion, typical
from .surface import exposure, normals, surface
from .surface.families import CornerLists, Corners, Families

_WORDS = 9 + 2 * normals.SHARE
"""Number of columns in a row of ``Exterior.widened``. A row describes a crack that becomes part of the surface."""


class Exterior:
    """Surface of the bodies of one rank: faces, edges, cracks and mean normals."""

    def __init__(
        self, model: Model, neighbours: list[Neighbour], bounds: list[Boundary], edges: bool, comm: Comm, team: Team
    ) -> None:
        """``edges``: True if the run has edge-edge contact. Collective."""
        self._normals, self._corner_lists = normals.MeanNormals(team), CornerLists(team)
        self._builder = surface.SurfaceBuilder(team)
        self._model, self._neighbours, self._comm, self._edges = model, neighbours, comm, edges
        self._bounds = bounds
        self.cracks = Cracks.none(model.nodes.id)
        self._near_erosion: Ints | None = None
        """Global ids, ascending, of the local tets that were near erosion at the last search; None if no tet has eroded
        yet."""
        self.surface = self._build(np.zeros(model.nodes.n, bool), np.zeros(0, np.int64))
        self.size = typical(self.surface.faces.size, comm)
        """Typical size of a face at the start, m. All ranks have the same value."""
        self.motion = SurfaceMotion(self.surface, model.nodes, mobilities(model.nodes, bounds), self.size, comm)
        self._moments = np.zeros((model.nodes.n, normals.COLUMNS), np.int64)
        self._broken = False
        """True if facets of any rank have broken, so that cracks may open."""
        columns = model.nodes.columns
        columns.declare(self, _moments=COPIED)
        columns.declare(self, "motion", **SurfaceMotion.COLUMNS)
        columns.declare(self, "motion.found", flags=COPIED)
        columns.declare(self, "cracks.families", **Families.COLUMNS)

    def keep(self, parcel: Parcel) -> None:
        """Adds cracks, edges that have become sharp, surface nodes and moments of normals to the ``parcel`` (a
        checkpoint or migration message).
        """
        parcel.rows["contact.cracks"] = self.cracks.keep(parcel.nodes["id"])
        parcel.nodes["family"] = self.cracks.families.root
        parcel.rows["contact.turned"] = {"tet": self.surface.turned >> 34, "name": self.surface.turned}
        parcel.nodes["contact.flags"], parcel.nodes["contact.moments"] = self.surface.flags, self._moments
        parcel.nodes["contact.loose"] = self.motion.loose

    def resume(self, parcel: Parcel, size: float, broken: bool) -> None:
        """Restores the state of this object from a parcel. Collective."""
        self.size, self._broken = size, broken
        turned = np.sort(parcel.rows["contact.turned"]["name"])
        self.surface.sharpen(turned)
        self.surface.turned = turned  # includes edges at cracks, which the next search adds to the surface
        self.surface.flags = np.array(parcel.nodes["contact.flags"])
        self._moments = np.array(parcel.nodes["contact.moments"])
        nodes = self._model.nodes
        self.motion = SurfaceMotion(self.surface, nodes, mobilities(nodes, self._bounds), size, self._comm)
        self.motion.loose = np.array(parcel.nodes["contact.loose"])
        root = np.array(parcel.nodes["family"])
        self.cracks = Cracks.resume(parcel.rows["contact.cracks"], root, self._model.blocks, nodes)

    def require_faces(self, allowed: Flags) -> None:
        """Raises InputError on all ranks if a part that may be in contact has no exposed face, and no part of the same
        body has one. A core inside a jacket with common nodes gets exposed faces when the jacket erodes. ``allowed``
        (parts, parts): pairs of parts that may be in contact.
        """
        model = self._model
        first = np.searchsorted(model.nodes.id, self.surface.faces.nodes[:, 0])
        counts = self._comm.sum(np.bincount(model.nodes.part[first], minlength=len(model.parts)).astype(np.int64))
        exposed, joined = counts > 0, self._comm.sum(model.nodes.shares.joined(model.nodes.part, len(model.parts))) > 0
        for _ in model.parts:
            exposed |= joined[:, exposed].any(axis=1)
        for index in np.flatnonzero(~exposed & allowed.any(axis=1)):
            raise InputError(
                f"contact: part {model.parts[index]!r} has no exposed face, all lie on symmetry planes; "
                "leave it out of contact.parts"
            )

    @property
    def owned(self) -> Flags:
        """(nodes,) whether each node is a surface node that this rank owns."""
        return self.surface.flags & self._model.nodes.owned

    def _build(self, flags: Flags, turned: Ints) -> surface.Surface:
        """Returns the surface, which includes the sides of cracks that may open, and the faces behind tets near
        erosion. ``flags`` (n,): nodes that have been on the surface and remain surface nodes; ``turned``: edges that
        have become sharp and remain sharp. Collective.
        """
        model, neighbours, comm = self._model, self._neighbours, self._comm
        sides, covered = self.cracks.foresee(), np.zeros((0, 3), np.int32)
        if self._near_erosion is not None:
            covered = exposure.covered(model.blocks, self._near_erosion, neighbours, comm)
        found = self._builder.build(model, self._planes, neighbours, comm, self._edges, sides, covered)
        found.flags[: len(flags)] |= flags
        found.sharpen(turned)
        return found

    def sharpen(self, scene: Scene, least: Floats) -> None:
        """Marks an edge as sharp if the cosine between the normals of its two faces is below ``least`` (parts,). An
        edge that was sharp once remains sharp.
        """
        turned = np.flatnonzero(scene.sharpen(least)[: self.surface.edges.n])
        if len(turned):
            self.surface.sharpen_at(turned)

    def uncover(self, gone: Ints, loose: Flags, removed: Flags, scene: Scene | None) -> bool:
        """Updates mean normals, surface nodes and the ``scene`` after erosion. ``gone`` (k, exposure.WORDS): removed
        tets of this rank; ``loose`` (nodes,): nodes without tets that stay in the model; ``removed`` (nodes,): nodes
        that are removed from the model. Returns True if a search must add faces that are missing in the scene.
        Collective.
        """
        if self._near_erosion is None:
            self._near_erosion = np.zeros(0, np.int64)
        known = among(self._near_erosion, gone[:, 0])
        received = self._comm.join(np.column_stack([known, gone]).reshape(-1)).reshape(-1, 1 + exposure.WORDS)
        laid = exposure.exposed_by(received[:, 1:])
        exposure.expose(self._model.blocks, laid.bare)
        flags, local = self.surface.flags, self._model.nodes.places(laid.nodes)
        flags[local[local >= 0]] = True
        flags |= loose
        flags &= ~removed
        self.motion.forget(removed)
        self.cracks.forget(removed, self._model.nodes.id)
        self._loosen(loose)
        self.turn()
        if scene is not None:
            scene.node_face.wake()
        if scene is None or not received[:, 0].all():
            return True
        scene.uncover(laid.gone, laid.bare, scene.own.place[removed])
        self.show(scene, scene.own.local)
        scene.surface_nodes.mobility[scene.own.slots] = self.motion.mobility[scene.own.local]
        return False

    def _loosen(self, loose: Flags) -> None:
        """Updates the mobility of nodes that have lost their last tet. A node without tets is held only by boundaries
        that act on the node itself.
        """
        if (loose & ~self.motion.loose).any():
            self.motion.loose, self.motion.mobility = loose, mobilities(self._model.nodes, self._bounds)

    def take_up(self) -> None:
        """Builds the surface; it includes all faces that may become surface before the next search. Collective."""
        if self._near_erosion is not None:
            self._near_erosion = exposure.near_erosion(self._model.blocks)
        if self._broken or self._near_erosion is not None:
            self.surface = self._build(self.surface.flags, self.surface.turned)

    def age(self) -> bool:
        """Admits the edges of all present cracks to edge-edge contact, if the run has edge-edge contact. Returns True
        if a search must add edges of cracks. Collective.
        """
        return self._edges and self.cracks.age(self._comm.sum(self.cracks.ages))

    @property
    def _planes(self) -> Flags:
        return symmetry_planes(self._model.nodes.n, self._bounds)

    def turn(self) -> None:
        """Recomputes the mean normals of all nodes. Collective."""
        self._moments = self._normals.moments(self._model, self._planes, self.size, self._neighbours, self._comm)

    def show(self, scene: Scene, local: "np.ndarray") -> "np.ndarray":
        """Writes to the scene the mean normals of the nodes ``local`` of this rank, and whether these nodes are on the
        surface. Returns the slots of the nodes.
        """
        place = scene.own.place[local]
        local, place = local[place >= 0], place[place >= 0]
        self._normals.means(scene.slots.normals, place, self._moments, local.astype(np.int32, copy=False))
        scene.slots.on_surface[place] = self.surface.flags[local]
        return np.asarray(place)

    def refresh(self, course: Floats, t: float) -> None:
        """Sets the positions at the simulated time ``t`` and the extrapolated velocities ``course`` (nodes, 3) of the
        present surface. Collective.
        """
        nodes = self._model.nodes
        self.motion.begin(nodes, course, t)
        if self.motion.found is not self.surface:
            self.motion.follow(self.surface, nodes)
        else:
            self.motion.refresh(nodes)

    def widened(self, rows: Ints) -> Ints:
        """(k, _WORDS) messages about the cracks ``rows`` (k,). A message contains: a flag, 1 if the last search
        included the crack; ids of its two sides; ids of the nodes of each side, counter-clockwise seen from outside;
        contributions of the sides to the moments of the nodes.
        """
        if not len(rows):
            return np.zeros((0, _WORDS), np.int64)
        nodes, cracks = self._model.nodes, self.cracks
        sides = cracks.nodes[rows][:, [0, 1, 2, 3, 5, 4]]
        shares = normals.shares(nodes.x, sides.reshape(-1, 3), self.size).reshape(-1, 2 * normals.SHARE)
        return np.column_stack([cracks.foreseen[rows], cracks.faces[rows], nodes.id[sides], shares])

    def open(self, received: Ints, scene: Scene | None) -> bool:
        """Adds the sides of the wide cracks of all ranks to the surface; ``received``: rows of ``widened``. Returns
        True if some sides of wide cracks are missing in the scene.
        """
        received = received.reshape(-1, _WORDS)
        nodes, sides = self._model.nodes, received[:, 3:9].reshape(-1, 3)
        local = nodes.places(sides)
        normals.add(self._moments, received[:, 9:].reshape(-1, normals.SHARE), local)
        local = np.unique(local[local >= 0])
        self.surface.flags[local] = True
        faces = np.sort(received[:, 1:3].reshape(-1))
        self.cracks.open(faces, self._model.blocks)
        if scene is not None:
            scene.expose(faces)
            scene.slots.fresh[self.show(scene, local)] = True
            scene.cracks = self.cracks.places
        return bool((received[:, 0] == 0).any())

    def narrow(self) -> list[tuple[Block, Corners]]:
        """Blocks with broken facets, and the corners of the narrow sides of these facets; see
        narrow_phase/corner_contact.py.
        """
        some = enumerate(self._model.blocks) if len(self.cracks.faces) else ()
        return [(block, self.cracks.corners(b, self._corner_lists)) for b, block in some if len(block.bond)]

    def separate(self, split: Split) -> Ints:
        """Updates the cracks after nodes have separated on any rank. Returns the rows of the cracks that have a
        separated node.
        """
        self._broken |= bool(split.touched.any())
        if not split.copies.n:
            return np.zeros(0, np.int64)
        return self.cracks.follow(split, self._model.nodes.id, self._corner_lists.touching)

    def grow(self, split: Split) -> None:
        """Sets the mobilities of separated nodes and of their copies, which have new masses."""
        _lighten(self.motion.mobility, self._model.nodes.mass, split.copies.parents, split.first)


@njit("void(float64[:, ::1], float64[::1], int64[::1], int64)", cache=True)
def _lighten(mobility, mass, parents, first):  # type: ignore[no-untyped-def]
    """Sets the mobilities of ``parents`` (k,) and of their copies to the inverse of their masses. The copies have
    numbers from ``first`` on. Components that are held remain 0.
    """
    for c in range(len(parents)):
        for i in range(3):
            for a in (parents[c], first + c):
                if mobility[a, i] > 0.0:
                    mobility[a, i] = 1.0 / mass[a]


def mobilities(nodes: Nodes, bounds: list[Boundary]) -> Floats:
    """(nodes, 3) inverse of the mass of each node, 1/kg; zero in directions in which the node is held."""
    mobility = np.repeat(1.0 / nodes.mass[:, None], 3, axis=1)
    for bound in bounds:
        mobility[bound.nodes] = np.where(bound.held_components() == FREE, mobility[bound.nodes], 0.0)
    return mobility


def symmetry_planes(n: int, bounds: list[Boundary]) -> Flags:
    """(nodes, planes) whether each of ``n`` nodes is on each symmetry plane. Two planes normal to the same axis are two
    columns."""
    mirrors = [bound for bound in bounds if bound.mirrors]
    planes = np.zeros((n, len(mirrors)), bool)
    for k, bound in enumerate(mirrors):
        planes[bound.nodes, k] = True
    return planes
