"""Probes and references. Probes are means over tets, and measurements (gauges) of forces, sums over nodes, fragments
and shapes.
"""
