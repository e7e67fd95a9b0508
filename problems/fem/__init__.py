"""Finite elements: Bogner–Fox–Schmit plates on tensor grids, and what stiffens and loads them."""
