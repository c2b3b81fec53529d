"""Bonds of meshes that do not match: nodes of one surface tied to faces of another."""
