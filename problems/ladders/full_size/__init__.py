"""Ladders at the sizes of the paper: n = 4386, 6112 and 11308."""
