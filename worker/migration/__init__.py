"""The complete state of a run by global ids. It is moved between ranks, written to disk, and read on any number of
ranks.
"""
