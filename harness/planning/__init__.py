"""Suites, their changes and measurements in order; which are still worth making, and in which form."""
