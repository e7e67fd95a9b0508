"""What a results directory holds, as data frames."""
