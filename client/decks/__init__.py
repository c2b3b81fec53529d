"""Decks of other codes become cases: what is read of them, what is not, and in which units they are."""
