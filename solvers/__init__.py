"""Solvers behind one interface: the in-house methods and the adapters of the libraries."""
