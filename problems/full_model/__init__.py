"""The model of a scene: all its unknowns, sparse; or condensed onto the junction, for the dense forms."""
