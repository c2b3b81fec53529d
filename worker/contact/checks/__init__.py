"""Checks at the start and at the end of a run: nodes and volumes of a body that are inside of another body."""
