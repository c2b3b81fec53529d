"""The complete state of a run by global ids. A parcel is sent between ranks, written to disk, and read on any number of
ranks.
"""
