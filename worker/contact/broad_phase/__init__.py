"""Candidate pairs. The modules are the search by cells, the swept filter, reference motions, and the schedule of
searches.
"""
