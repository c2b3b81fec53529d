"""Radioss starter and engine decks."""
