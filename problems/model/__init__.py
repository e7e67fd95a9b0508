"""Joints, their parts as finite elements, the base classes of effects, and the model of a scene."""
