"""V8: the frequency of a standing plane P-wave between rollers converges with the square of the element size."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from conoid.worker.model.rows import WORK
from conoid.worker.simulation import Simulation

from ..worker.kernels import FORMS, STEEL, Form, build, run, scene
from ..worker.meshes import Floats, block
from .convergence import assert_converges

LENGTH, SPEED = 40e-3, 5856.3822
"""Wavelength, m, and c_P of STEEL, m/s."""
START = np.array([1.0, 1.0, 0.0])


def ring(
    cells: int, form: Form = "standard", periods: float = 4.0, mirrored: bool = False
) -> tuple[Simulation, Floats, Floats]:
    """Runs a bar with v_z = sin(2 pi z / L) at the start; returns times, modal amplitudes of the velocity, and the
    energy balance. If ``mirrored`` is True, the mesh is symmetric about the rollers, so that the wave is a wave in a
    wide body.
    """
    size = LENGTH / cells
    faces = tuple(
        {"kind": "symmetry", "axis": axis, "at": at}
        for axis, top in (("x", 2 * size), ("y", 2 * size), ("z", LENGTH))
        for at in (0.0, top)
    )
    case = scene(STEEL, form, end=periods * LENGTH / SPEED, boundaries=faces)
    sim = build(case, [block((2, 2, cells), size, shake=0.0, mirrored=mirrored)])
    nodes = sim.model.nodes
    mode = np.sin(2.0 * np.pi * nodes.x0[:, 2] / LENGTH)
    nodes.v[:, 2] = 1e-3 * mode
    weight = nodes.mass * mode / (nodes.mass * mode**2).sum()
    amplitudes: list[tuple[float, float]] = []
    energies: list[float] = []

    def look(sim: Simulation, before: Floats) -> None:
        amplitudes.append((sim.clock.t + 0.5 * sim.clock.dt, float(weight @ nodes.v[:, 2])))
        kinetic = 0.5 * float((nodes.mass[:, None] * before * nodes.v).sum())
        energies.append(kinetic + float(sim.model.blocks[0].row(WORK).sum()))

    run(sim, look)
    return sim, np.array(amplitudes[:-3]), np.array(energies[2:-3])


def fitted(seen: Floats, first: Floats = START) -> Floats:
    """Returns the frequency over the exact frequency, and the amplitude and phase of a cosine fitted to the modal
    amplitudes; ``first`` is a guess of the frequency."""
    omega = 2.0 * np.pi * SPEED / LENGTH

    def missed(guess: Floats) -> Floats:
        share, amplitude, phase = guess
        return np.asarray(amplitude * np.cos(share * omega * seen[:, 0] + phase) - seen[:, 1] / 1e-3)

    return np.asarray(least_squares(missed, first, xtol=1e-14, ftol=1e-14, gtol=1e-14).x)


def loss(seen: Floats) -> float:
    """Returns the loss of amplitude in one wavelength, from the two halves of eight wavelengths."""
    half = len(seen) // 2
    early = fitted(seen[:half])
    return float(1.0 - fitted(seen[half:], early)[1] / early[1]) / 4.0


@pytest.mark.parametrize("form", FORMS)
def test_phase_error_falls_with_the_square_of_the_size(form: Form) -> None:
    errors = [abs(float(fitted(ring(cells, form)[1])[0]) - 1.0) for cells in (10, 20, 40)]
    assert_converges(f"plane_wave_{form}", errors)


@pytest.mark.parametrize("form", FORMS)
def test_a_wave_of_twenty_elements_keeps_its_height(form: Form) -> None:
    """Without viscosity the amplitude does not decrease, except for the energy that the split form dissipates in its
    pressure modes. The energy balance closes in all pressure forms.
    """
    _, seen, energies = ring(20, form, periods=8.0, mirrored=True)
    assert -1e-5 < loss(seen) < (1.6e-3 if form == "split" else 1e-5)
    assert np.abs(energies / energies[0] - 1.0).max() < 1e-8


def test_what_the_split_form_spends_falls_fast() -> None:
    """The stabilisation of the split form acts on fourth differences of the pressure, over a time step: the loss is of
    third order in the size."""
    assert_converges("split_loss", [loss(ring(cells, "split", 8.0, mirrored=True)[1]) for cells in (10, 20, 40)])
