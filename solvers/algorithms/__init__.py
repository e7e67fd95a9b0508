"""The parts of the methods: contact sets and pivots, factors, Newton systems, starting points."""
