"""The contract between client, server and worker: models of a case, messages of a run, files of a run. Uses the
standard library, pydantic and msgspec only."""
