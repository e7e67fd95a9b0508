"""Riveting problems: parts, condensation, effects, scenes and their matrices."""

from pathlib import Path

#: The version of the distribution; it stands here because all of its packages may import it.
__version__ = "0.4.0"
#: The folder that holds the project's packages.
ROOT = Path(__file__).resolve().parents[1]
