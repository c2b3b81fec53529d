"""What probes measure that is no mean over tets: pushes, sums over nodes, what is behind a target, shapes."""
