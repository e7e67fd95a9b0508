"""One solver on one problem: its steps, its valid answer, and the in-house methods in turn."""
