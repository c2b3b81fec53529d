"""Rows of the element state. Rows up to DISTORTION exist in every block, the others where a material or a pressure form
needs them; some rows have another meaning in other materials.
"""

S_XX, S_YY, S_ZZ, S_YZ, S_ZX, S_XY = range(6)
"""Deviatoric Cauchy stress, Pa."""
PRESSURE = 6
"""Pressure without the viscous part, Pa."""
VISCOUS = 7
"""Bulk-viscosity pressure q, Pa."""
MASS = 8
"""Mass, kg."""
WORK = 9
"""Work of the stress since the start, without the viscous part, J."""
WORK_VISCOUS = 10
"""Work of the bulk viscosity since the start, J."""
DISTORTION = 11
"""Elastic energy of the deviatoric stress, J (materials without a strength)."""
VOLUME_FLUX = 12
"""Rate of change of the volume at mid-step, m^3/s (averaged pressure forms)."""
TET_VOLUME = 12
"""Volume at the end of the last pass, m^3 (materials without a strength). The first pass, of zero time, sets it."""
WORK_AVERAGED = 13
"""The part of WORK that the pressure has not done on the averaged volume, J (averaged pressure forms;
elements/mean.py)."""
VOLUME_RATIO = 14
"""Current over initial volume, by the dilatation from which the pressure is computed."""
PLASTIC_STRAIN = 15
"""Effective plastic strain."""
WORK_PLASTIC = 16
"""Plastic work since the start, J."""
YIELD = 17
"""Flow stress at vanishing rate, Pa: no plastic flow below it."""
FLOW = 18
"""Flow stress of the last plastic step, Pa: the first guess of the next one."""
BULKING = 18
"""Bulking pressure, Pa (Johnson-Holmquist)."""
DILATION = 18
"""Volume strain of the plastic flow in the last step (Mohr-Coulomb); below zero once it is part of the nodal mean
(averaged pressure forms)."""
TEMPERATURE = 19
"""Temperature, K."""
DAMAGE = 20
"""Damage, from 0 (intact) to 1 (failed), in laws that have it."""
PORES = 21
"""Volume of the pores opened by a tension cut-off over that of the solid matter; with a linear pressure the logarithm
of one plus that."""
HEAT = 22
"""Energy from which the pressure of a tet is computed, over the bulk modulus at rest, m^3: its own for a flat tet, a
mean over its nodes for the others (averaged pressure forms, if the equation of state depends on energy)."""
BULKING_STEP = 22
"""Bulking of the last step, Pa, that is not yet part of the nodal mean (Johnson-Holmquist, averaged pressure forms)."""
CORNERS = 23
"""First of four rows: current over initial volume at each node of a tet, from which the pressure there is computed
(Johnson-Holmquist, averaged pressure forms)."""
NODAL_WORK = 23
"""The part of the work that is in the nodal mean of HEAT, J."""
WORKS = WORK, WORK_VISCOUS, WORK_PLASTIC, WORK_AVERAGED
"""Rows that the energy ledger sums up over the tets, with those of removed tets."""
