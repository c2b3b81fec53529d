"""Candidate pairs of contact. The modules contain the search by cells, the swept filter, reference motions, and the
schedule of searches.
"""
