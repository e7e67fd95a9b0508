"""Riveting problems: parts, condensation, effects, scenes and their matrices."""

#: Of the distribution with its four packages; here because all of them may import it.
__version__ = "0.4.0"
