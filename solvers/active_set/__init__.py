"""What the active-set methods are made of."""
