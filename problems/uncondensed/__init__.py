"""The finite-element model itself, without condensation: K̂ sparse, all unknowns kept."""
