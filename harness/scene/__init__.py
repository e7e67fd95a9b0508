"""One scene: validated, solved, exported."""
