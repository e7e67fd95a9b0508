"""The figures: their style, and drawings that several sections share."""
