"""Textbook methods, short and with SciPy alone, as an engineer in contact mechanics writes them first."""
