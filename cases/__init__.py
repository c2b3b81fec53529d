"""The models of a case, the messages of a run, and the names of its files: the interface of client, server and worker.
The package cases uses only the standard library, pydantic and msgspec.
"""
