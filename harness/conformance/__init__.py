"""Whether a solver keeps the contract, in plain words."""
