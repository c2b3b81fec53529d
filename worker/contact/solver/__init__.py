"""Solver of contact, which computes the impulses of the active contacts by projected Jacobi sweeps, and sums over
ranks.
"""
