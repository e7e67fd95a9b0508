"""Runs solvers on problems, one process a measurement, and judges what they answer."""
