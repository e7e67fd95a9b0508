"""What the methods are made of: contact sets and pivots, factors, Newton systems, starting points."""
