"""User input: tables, CSV files and matrices, read and checked, every fault reported in plain words."""
