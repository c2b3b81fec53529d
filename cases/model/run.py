"""The models of a run: end time, cores, output, limits and load balance."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from ..units import Ratio, Time
from .tables import Count, Model, Positive, SetName, Switch, off

Scale = Annotated[Ratio, Field(gt=0)]

FrameField = Literal["density", "strain", "strain_rate", "contact_pressure"]

MOST_RANKS, MOST_THREADS = 4096, 256
"""Largest number of ranks, and largest number of threads of a rank: far above those of any run so far (chosen values).
"""


class Run(Model):
    """Duration of the run, cores, output, and limits at which the run stops."""

    end_time: Annotated[Time, Positive]
    """Simulated time at which the run ends. The simulated time of a run starts at 0."""
    ranks: Annotated[Count, Field(ge=1, le=MOST_RANKS)] = 1
    """Number of MPI processes. The answer does not depend on the number of MPI processes."""
    threads: Annotated[Count, Field(ge=1, le=MOST_THREADS)] = 1
    """Number of threads of each MPI process. The answer does not depend on the number of threads. A run uses ``ranks``
    times ``threads`` cores; if the machine has fewer cores, the run is slower. If the case has no key ``threads``,
    ``conoid run``, ``conoid demo`` and a server that starts runs itself use all cores; a server uses at most one thread
    for each 3,000 tets. In a sweep and in a batch system a run without ``threads`` has one thread for each rank."""
    profile: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{0,32}$")] = ""
    """Profile of the site with which a batch system executes the run (docs/howto/cluster.md). A profile that is given
    at submission has priority over this key."""
    cut_scale: tuple[Scale, Scale, Scale] = (1.0, 1.0, 1.0)
    """Factors by which the coordinates are multiplied for the domain decomposition. A small factor along a direction
    avoids cuts across this direction. With a small factor along the direction of impact, every rank has a part of the
    impact zone. The key ``cut_scale`` changes the cost of a run, not its answer."""
    frames: Annotated[Count, Field(ge=0, le=100_000)] = 20
    """Number of frames (complete fields, VTKHDF), evenly spaced up to the end; frame 0 is the initial state. 0: no
    frames. A time step ends at the time of each frame; therefore another number of frames changes the time steps. The
    fracture pattern of bodies that break into many fragments then changes, as with another ``dt_safety``."""
    fields: tuple[FrameField, ...] = ()
    """Names of additional fields of the frames. ``density``: current density of the tets. ``strain``: logarithmic
    (Hencky) strain ln V of each tet, six tensor components, and ``effective_strain``, sqrt(2/3 e' : e') of the deviator
    e'. If the principal axes do not rotate, it equals the integral of the strain rate, which other explicit codes
    store. ``strain_rate``: sqrt(2/3 d' : d') of the deviator of the rate of deformation d. ``contact_pressure``:
    impulse of contact and walls on a node since the previous frame, divided by the time since then and by the node's
    share of the loaded surface; only the component normal to this share counts. The contact pressure is 0 in the first
    frame. The share of a node is a third of each of its faces whose normal deviates by less than 60 degrees from the
    impulse. Forces of walls on rigid parts are not included in ``contact_pressure``: use a probe of ``wall_force``."""
    sets: tuple[SetName, ...] = ()
    """Names of node sets and surfaces of mesh files. Frames contain these sets, and the sets that boundaries and probes
    select with ``on``: a point array ``set_NAME`` for each set, 1 on the nodes of the set. The command ``conoid view
    --on NAME`` draws the tets that have a node in the set NAME."""
    samples: Annotated[Count, Field(ge=1, le=1_000_000)] = 500
    """Number of lines of history.csv, evenly spaced up to the end."""
    snapshots: Annotated[Count, Field(ge=0, le=100_000)] = 100
    """Number of snapshots (surface of the fragments, for the live view), evenly spaced up to the end, in addition to
    one of the initial state. 0: snapshots are made only on request. At most one snapshot is made per second of wall
    time, and fewer if they would use more than 1/200 of the wall time. The first and the last snapshot are always made.
    """
    max_steps: Annotated[Count, Field(ge=1)] = 100_000_000
    """Largest number of time steps. A run that reaches this number writes a checkpoint and stops with the state
    ``timed_out`` and the cause ``steps``. The command ``conoid restart RUN --max-steps NUMBER`` continues such a run.
    """
    max_wall_time: Annotated[Time, Positive] | None = None
    """Largest wall time of the run, counted from the first time step. A run that reaches this wall time writes a
    checkpoint and stops. Default: no limit."""
    checkpoint_every: Annotated[Annotated[Time, Positive] | None, BeforeValidator(off), Switch()] = 600.0
    """Wall time between checkpoints. A checkpoint is also written on request, when a user stops the run, and at
    ``max_wall_time``; with ``"none"`` a checkpoint is written only in these cases."""
    residual_limit: Annotated[Ratio, Positive] = 0.05
    """Largest energy residual divided by the largest energy so far. A run with a larger residual fails with the cause
    ``energy``. The run also fails if the kinetic energy exceeds all supplied energy by more than this fraction of the
    largest energy."""
    made_limit: Annotated[Ratio, Positive] = 0.02
    """Largest energy that a single term of the energy ledger may create, divided by the largest energy so far. A run in
    which a term creates more fails with the cause ``energy``. A term creates energy if a dissipation decreases
    (``plastic``, ``viscous``, ``friction``, ``fracture``), if the term releases more than it has absorbed (``contact``,
    ``averaging``, ``eroded``, ``cohesive``), or if time steps of unequal length create or remove energy (``stepping``).
    A change of a kinetic energy by 2 % corresponds to a change of a speed by 1 %."""

    @property
    def cores(self) -> int:
        """The number of cores of the run."""
        return self.ranks * self.threads


class Balance(Model):
    """Load balance: when tets are distributed over the ranks again, and which quantity is divided evenly. The answer of
    a run does not depend on the load balance.
    """

    policy: Literal["measured", "outside", "every", "never"] = "measured"
    """Criterion for a new decomposition of the mesh among the ranks. ``measured``: when the time lost by imbalance
    since the last decomposition exceeds the cost of a new decomposition. ``outside``: the mesh is decomposed again when
    the number of outside nodes of a rank has grown by the factor ``alpha`` (criterion of Moon, Kim and Lee). ``every``:
    the mesh is decomposed again after a fixed number of time steps. ``never``: the mesh is not decomposed again."""
    alpha: Annotated[Ratio, Field(gt=1)] = 1.2
    """With ``policy = "outside"``: growth factor of the outside nodes of a rank that triggers a decomposition."""
    every: Annotated[Count, Field(ge=1)] = 1000
    """With ``policy = "every"``: number of time steps between two decompositions."""
    weights: Literal["measured", "outside", "tets"] = "measured"
    """Quantity that is divided evenly among the ranks: measured CPU time, outside nodes, or tets."""
