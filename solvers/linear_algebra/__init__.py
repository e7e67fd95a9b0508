"""Products, factors and inverses shared by several methods."""
