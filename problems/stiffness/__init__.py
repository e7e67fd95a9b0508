"""The stiffness matrix K as an operator: dense, banded or general sparse diagonal blocks."""
