"""Impulses of the active contacts: projected Jacobi sweeps, and sums over ranks."""
