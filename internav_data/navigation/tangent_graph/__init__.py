"""Exact shortest paths of a disc among polygons, on a graph of tangents (Liu and Arimoto 1992)."""
