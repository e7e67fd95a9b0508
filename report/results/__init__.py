"""What a results directory holds, as data frames, and what the paper prints."""
