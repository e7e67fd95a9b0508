"""Checks whether a solver keeps its contract; findings in plain words."""
