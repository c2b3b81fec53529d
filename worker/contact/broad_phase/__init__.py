"""Candidate pairs: search by cells, swept filter, reference motions, and the schedule of searches."""
