"""What a user writes: tables, CSV files and matrices, read and checked; every fault in plain words."""
