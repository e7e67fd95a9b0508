"""Products, factors and inverses that several methods share."""
