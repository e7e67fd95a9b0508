"""The solvers of this project, one file per method."""
