"""The quadratic programs: the data that load cases share, and one file per form."""
