"""Ladders: each file is one way in which a problem grows hard."""
