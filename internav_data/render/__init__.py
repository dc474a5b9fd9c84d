"""Camera on the processor: meshes, culling by portals, a rasteriser, shading."""
