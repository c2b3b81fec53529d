"""The complete state of a run by global ids: moved between ranks, written to disk, read on any number of ranks."""
