"""Contact of bodies. The packages are the surface, the broad phase, the narrow phase, and the solver of the impulses.
Surfaces of other ranks are present as ghosts.
"""
