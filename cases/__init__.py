"""The contract: what a case is, what a run says, what a run leaves. Standard library, pydantic and msgspec only."""
