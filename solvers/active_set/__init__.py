"""Building blocks of the active-set methods."""
