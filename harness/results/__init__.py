"""The files of a results directory."""
