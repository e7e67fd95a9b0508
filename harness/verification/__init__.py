"""References with proven error bounds, verdicts, the accuracy gate."""
