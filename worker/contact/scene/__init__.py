"""The surface near one rank: own rows, ghosts of other ranks, candidate pairs; updates between two searches."""
