"""Nodes and volumes of a body that lie inside of another one: at the start and at the end of a run."""
