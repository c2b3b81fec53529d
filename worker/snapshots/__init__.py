"""Snapshots of the fragments: copies that the ranks make between two steps, and a separate process that makes
snapshots from the copies.
"""
