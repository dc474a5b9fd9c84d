"""Exact shortest paths of a disc among polygons, on a graph of tangents.

Y.-H. Liu and S. Arimoto, "Path planning using a tangent graph for mobile robots among polygonal and
curved obstacles", 1992; for a disc: "Finding the shortest path of a disc among polygonal obstacles
using a radius-independent graph", 1995. Added here: obstacles that come and go without a rebuild of
the house's graph, and a proof of disconnection that needs no search.
"""
