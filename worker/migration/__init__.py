"""The complete state of a run by global ids. A parcel is a part of the state that is sent between ranks or written to
disk. A parcel can be read on any number of ranks.
"""
