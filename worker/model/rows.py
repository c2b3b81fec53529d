"""Indices of the rows of the element state.

The rows up to DISTORTION exist in every block. A block has a further row only if its material or the pressure form
needs the row. Some indices have different meanings in different materials.
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
"""Elastic energy of the deviatoric stress, J (only materials without a strength law have this row)."""
VOLUME_FLUX = 12
"""Rate of change of the volume at mid-step, m^3/s (only averaged pressure forms have this row)."""
TET_VOLUME = 12
"""Volume at the end of the last pass over the elements, m^3 (only materials without a strength law have this row). The
first pass over the elements, with a time step of zero, sets the initial volume."""
WORK_AVERAGED = 13
"""Difference between the work of the pressure on the tet and its work on the averaged volume, J; the row WORK contains
the difference, too (only averaged pressure forms; elements/mean.py)."""
VOLUME_RATIO = 14
"""Ratio of the current to the initial volume; the value is computed from the same dilatation as the pressure."""
PLASTIC_STRAIN = 15
"""Effective plastic strain."""
WORK_PLASTIC = 16
"""Plastic work since the start, J."""
YIELD = 17
"""Flow stress at vanishing strain rate, Pa. Plastic flow begins at the flow stress."""
FLOW = 18
"""Flow stress of the last plastic step, Pa. The iteration of the next plastic step starts with the flow stress of the
last plastic step."""
BULKING = 18
"""Bulking pressure, Pa (Johnson-Holmquist)."""
DILATION = 18
"""Volume strain of the plastic flow in the last step (only Mohr-Coulomb). After the value was added to the nodal mean,
it is stored as a negative number (only averaged pressure forms)."""
TEMPERATURE = 19
"""Temperature, K."""
DAMAGE = 20
"""Damage, from 0 (intact) to 1 (failed); only material laws with damage have this row."""
PORES = 21
"""Volume of the pores opened by a tension cut-off, divided by the volume of the solid matter. If the equation of state
is linear, the row PORES has the logarithm of 1 + the ratio of pores to solid matter."""
HEAT = 22
"""Energy from which the pressure of a tet is computed, divided by the initial bulk modulus, m^3. The energy of a flat
tet is its own energy; that of another tet is a mean over its nodes. The row exists in averaged pressure forms if the
equation of state depends on energy."""
BULKING_STEP = 22
"""Bulking pressure of the last step, Pa, that is not yet in the nodal mean (Johnson-Holmquist, averaged pressure
forms)."""
CORNERS = 23
"""Index of the first of four rows, one for each node of a tet: ratio of the current to the initial volume at this node.
The pressure at the node is computed from the volume ratio at the node (Johnson-Holmquist, averaged pressure forms)."""
NODAL_WORK = 23
"""Work on the tet that is already included in the nodal mean of HEAT, J."""
WORKS = WORK, WORK_VISCOUS, WORK_PLASTIC, WORK_AVERAGED
"""Rows whose sums over all tets are terms of the energy balance. The sums include removed tets."""
