"""What the interior-point methods are made of."""
