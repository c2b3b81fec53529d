"""The contract between client, server and worker: models of a case, messages of a run, files of a run. The package
cases uses only the standard library, pydantic and msgspec.
"""
