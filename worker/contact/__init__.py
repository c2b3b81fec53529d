"""Contact of bodies: surface, broad phase, narrow phase and solver of the impulses, with ghosts of other ranks."""
