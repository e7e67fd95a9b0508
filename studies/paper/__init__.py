"""The paper's tables, figures and claims beside its published numbers, from results of the suite `paper`."""
