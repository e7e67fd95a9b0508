"""Textbook methods, short and with SciPy alone: what somebody in contact mechanics writes first."""
