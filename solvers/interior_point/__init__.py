"""Building blocks of the interior-point methods."""
