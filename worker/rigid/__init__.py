"""Rigid parts: six degrees of freedom each, the same on all ranks, moved by sums of integer impulses."""
