"""Rigid parts: bodies with six degrees of freedom each. All ranks have equal values, because bodies are moved by
integer sums of impulses.
"""
