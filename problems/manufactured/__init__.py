"""Manufactured problems, with solutions known without a solver, and the ladders made of them."""
