"""Snapshots of the fragments: what ranks give away between two steps, and what a process of its own makes of it."""
