"""Where fasteners go: what plans of them leave open, and the search for the best one."""
