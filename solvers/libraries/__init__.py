"""Solvers from libraries, one file per library."""
