"""The models of a run: end time, cores, output, limits and load balance."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from ..units import Ratio, Time
from .tables import Count, Model, Positive, SetName, Switch, off

Scale = Annotated[Ratio, Field(gt=0)]

FrameField = Literal["density", "strain", "strain_rate", "contact_pressure"]

MOST_RANKS, MOST_THREADS = 4096, 256
"""Largest number of ranks, and largest number of threads. The values were chosen far above those of any run so far."""


class Run(Model):
    """Duration of the run, cores, output, and limits at which it stops."""

    end_time: Annotated[Time, Positive]
    """Simulated time at which the run ends. The simulated time starts at 0."""
    ranks: Annotated[Count, Field(ge=1, le=MOST_RANKS)] = 1
    """Number of MPI processes. The answer does not depend on it."""
    threads: Annotated[Count, Field(ge=1, le=MOST_THREADS)] = 1
    """Number of threads of each MPI process. The answer does not depend on it. A run uses ``ranks`` times
    ``threads`` cores; more of them than the machine has cores make it slower. ``conoid run`` and ``conoid demo`` use
    all cores of the machine if a case does not give this key. On a server and in a sweep such a run uses one core,
    because runs side by side use the cores better than the threads of one run."""
    profile: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{0,32}$")] = ""
    """Profile of the site under which a batch system executes the run (docs/howto/cluster.md). The profile that is
    given at submission has priority."""
    cut_scale: tuple[Scale, Scale, Scale] = (1.0, 1.0, 1.0)
    """Factors of the coordinates for the domain decomposition: cuts across a direction with a small factor are
    avoided. With a small factor along the direction of impact every rank receives a part of the impact zone. Changes
    the cost, not the answer."""
    frames: Annotated[Count, Field(ge=0, le=100_000)] = 20
    """Number of frames (complete fields, VTKHDF), evenly spaced up to the end; frame 0 is the initial state. 0: no
    frames. A time step ends at each frame, so another number changes the time steps, and with them the fracture
    pattern of bodies that shatter, as another ``dt_safety`` does."""
    fields: tuple[FrameField, ...] = ()
    """Additional fields of the frames. ``density``: current density of the tets. ``strain``: logarithmic (Hencky)
    strain ln V of each tet, six components, and ``effective_strain``, sqrt(2/3 e' : e') of its deviator; where the
    principal axes do not rotate, this is the integral of the strain rate that other explicit codes store, with
    tensor shear components. ``strain_rate``: sqrt(2/3 d' : d') of the rate of deformation d. ``contact_pressure``:
    impulse of contact and walls on a node since the previous frame, along the normal of its share of the loaded
    surface (a third of each face that is hit at less than 60 degrees), over that area and time; 0 in the first
    frame. Walls that push rigid parts are not included: use a probe of ``wall_force``."""
    sets: tuple[SetName, ...] = ()
    """Names of node sets and surfaces of mesh files. Frames contain these sets, and the sets that boundaries and probes
    select with ``on``: a point array ``set_NAME`` each, 1 on the nodes of the set. ``conoid view --on NAME`` draws the
    tets that have a node in the set."""
    samples: Annotated[Count, Field(ge=1, le=1_000_000)] = 500
    """Number of lines of history.csv, evenly spaced up to the end."""
    snapshots: Annotated[Count, Field(ge=0, le=100_000)] = 100
    """Number of snapshots of the fragments' surface for the live view, evenly spaced up to the end, and one of the
    initial state. 0: only snapshots on request. At most one per second of wall time, and fewer where they would use
    more than 1/200 of it; the first and the last are always made."""
    max_steps: Annotated[Count, Field(ge=1)] = 100_000_000
    """Largest number of time steps. A run that reaches it writes a checkpoint and stops with state ``timed_out``,
    cause ``steps``. ``conoid restart RUN --max-steps NUMBER`` continues the run."""
    max_wall_time: Annotated[Time, Positive] | None = None
    """Largest wall time, counted from the first time step. A run that reaches it writes a checkpoint and stops.
    Default: no limit."""
    checkpoint_every: Annotated[Annotated[Time, Positive] | None, BeforeValidator(off), Switch()] = 600.0
    """Wall time between checkpoints. A checkpoint is also written on request, when a user stops the run, and at
    ``max_wall_time``; with ``"none"`` only then."""
    residual_limit: Annotated[Ratio, Positive] = 0.05
    """Largest energy residual over the largest energy so far; beyond it the run fails with cause ``energy``. The run
    also fails if the kinetic energy exceeds all supplied energy by more than this fraction."""
    made_limit: Annotated[Ratio, Positive] = 0.02
    """Largest energy that a single line of the energy ledger may create, over the largest energy so far; beyond it the
    run fails with cause ``energy``. A line creates energy if a dissipation decreases (``plastic``, ``viscous``,
    ``friction``, ``fracture``), if a line releases more than it has absorbed (``contact``, ``averaging``, ``eroded``,
    ``cohesive``), or if time steps of unequal length create or remove energy (``stepping``). A change of an energy by 2
    % corresponds to 1 % of a speed."""

    @property
    def cores(self) -> int:
        """The number of cores of the run."""
        return self.ranks * self.threads


class Balance(Model):
    """Load balance: when tets are redistributed over the ranks, and by which weight. The answer of a run does not
    depend on the balance.
    """

    policy: Literal["measured", "outside", "every", "never"] = "measured"
    """Criterion for a new decomposition of the mesh. ``measured``: the time lost by imbalance since the last
    decomposition exceeds the cost of a new one. ``outside``: when the outside nodes of a rank have grown by the
    factor ``alpha`` (criterion of Moon, Kim and Lee). ``every``: after a fixed number of time steps. ``never``: not
    at all."""
    alpha: Annotated[Ratio, Field(gt=1)] = 1.2
    """With ``policy = "outside"``: growth factor of the outside nodes of a rank that triggers a decomposition."""
    every: Annotated[Count, Field(ge=1)] = 1000
    """With ``policy = "every"``: time steps between two decompositions."""
    weights: Literal["measured", "outside", "tets"] = "measured"
    """Quantity that is divided evenly among the ranks: measured CPU time, outside nodes, or tets."""
