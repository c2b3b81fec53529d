"""Snapshots of the fragments. The ranks copy their data between two steps, and a separate process makes the snapshots
from the copies.
"""
