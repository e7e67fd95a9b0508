"""Finite elements: Bogner–Fox–Schmit plates on tensor grids, their stiffeners and loads."""
