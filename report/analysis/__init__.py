"""What the rows mean: rankings, fits, accuracy, advice, warnings."""
