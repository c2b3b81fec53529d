"""Import of Radioss starter and engine decks."""
