"""Indices of the rows of the element state.

The rows up to DISTORTION exist in every block. A block has a further row only if its material or the pressure form
needs the row. Some indices have another meaning in other materials.
"""

S_XX, S_YY, S_ZZ, S_YZ, S_ZX, S_XY = range(6)
"""Deviatoric Cauchy stress, Pa."""
PRESSURE = 6
"""Pressure without the viscous part, Pa."""
VISCOUS = 7
"""Bulk-viscosity pressure q, Pa."""
MASS = 8
"""Mass of the tet, kg."""
WORK = 9
"""Work of the stress since the start, without the work of the viscous part, J."""
WORK_VISCOUS = 10
"""Work of the bulk viscosity since the start, J."""
DISTORTION = 11
"""Elastic energy of the deviatoric stress, J (materials without a strength law)."""
VOLUME_FLUX = 12
"""Rate of change of the volume at mid-step, m^3/s (averaged pressure forms)."""
TET_VOLUME = 12
"""Volume at the end of the last pass, m^3 (materials without a strength law); the first pass, for which the time step
is zero, sets this volume."""
WORK_AVERAGED = 13
"""Difference between the work of the pressure on the tet and its work on the averaged volume, J; WORK contains the
difference (averaged pressure forms; elements/mean.py)."""
VOLUME_RATIO = 14
"""Ratio of the current to the initial volume; the value is computed from the same dilatation as the pressure."""
PLASTIC_STRAIN = 15
"""Effective plastic strain."""
WORK_PLASTIC = 16
"""Plastic work since the start, J."""
YIELD = 17
"""Flow stress at vanishing strain rate, Pa; below this stress there is no plastic flow."""
FLOW = 18
"""Flow stress of the last plastic step, Pa. The iteration of the next plastic step starts with this value."""
BULKING = 18
"""Bulking pressure, Pa (Johnson-Holmquist)."""
DILATION = 18
"""Volume strain of the plastic flow in the last step (Mohr-Coulomb). After the value was added to the nodal mean, it is
stored as a negative number (averaged pressure forms)."""
TEMPERATURE = 19
"""Temperature, K."""
DAMAGE = 20
"""Damage, from 0 (intact) to 1 (failed), in material laws with damage."""
PORES = 21
"""Volume of the pores opened by a tension cut-off, divided by the volume of the solid matter. With a linear pressure
the row has the logarithm of 1 + this ratio."""
HEAT = 22
"""Energy from which the pressure of a tet is computed, divided by the initial bulk modulus, m^3. The energy of a flat
tet is its own energy; that of another tet is a mean over its nodes. Used in averaged pressure forms if the equation of
state depends on energy."""
BULKING_STEP = 22
"""Bulking pressure of the last step, Pa, that is not yet in the nodal mean (Johnson-Holmquist, averaged pressure
forms)."""
CORNERS = 23
"""Index of the first of four rows, one for each node of a tet: ratio of the current to the initial volume at this node.
The pressure at the node is computed from this ratio (Johnson-Holmquist, averaged pressure forms)."""
NODAL_WORK = 23
"""Work of the tet that is already in the nodal mean of HEAT, J."""
WORKS = WORK, WORK_VISCOUS, WORK_PLASTIC, WORK_AVERAGED
"""Rows whose sums over all tets, including removed tets, are in the energy balance."""
