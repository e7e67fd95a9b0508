"""What the paper's tables, figures and claims need of the rows of the suite `paper`."""
