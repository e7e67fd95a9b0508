"""Many load cases on one assembly: random gaps, measured gaps, sweeps."""
