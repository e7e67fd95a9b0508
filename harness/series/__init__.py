"""Many load cases on one assembly, opened and prepared once; each answer has a proven error bound."""
