"""The referee: references with proven error bounds, verdicts, the accuracy gate."""
