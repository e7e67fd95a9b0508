"""The quadratic programs: what load cases share, and one file per form."""
