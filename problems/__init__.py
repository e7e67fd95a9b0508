"""Riveting problems: parts, condensation, effects, scenes and their matrices."""

#: The version of the distribution; it stands here because all of its packages may import it.
__version__ = "0.4.0"
