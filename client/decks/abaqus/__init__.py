"""Abaqus/Explicit input files."""
