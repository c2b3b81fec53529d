"""The job server: accepts cases over HTTP, starts MPI workers from a queue, and reports their progress."""
