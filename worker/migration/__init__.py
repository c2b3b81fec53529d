"""The complete state of a run, keyed by global ids. A parcel (part of the state) is sent between ranks or written to
disk, and is read on any number of ranks.
"""
