"""Rigid parts: bodies with six degrees of freedom each, equal on all ranks, moved by integer sums of impulses."""
