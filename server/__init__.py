"""The job server: takes cases over HTTP, runs them as MPI workers one queue at a time, and tells how they go."""
