"""Riveting problems: parts, condensation, effects, scenes and their matrices."""
