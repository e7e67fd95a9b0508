"""A joint, its parts as finite elements, what an effect is; the model of a scene, whole or condensed."""
