"""What the rows mean: standings, fits, precision, advice, checks."""
