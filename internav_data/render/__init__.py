"""The camera: meshes of houses and assets, a rasteriser, culling, shading."""
