"""Nodes and volumes of a body inside of another body, at the start and at the end of a run."""
