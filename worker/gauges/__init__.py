"""Probes and references: means over tets, and gauges of forces, sums over nodes, fragments and shapes."""
