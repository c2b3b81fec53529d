"""Candidate pairs: search by cells, swept filter, reference motions, and when the next search is due."""
