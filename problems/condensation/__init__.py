"""From a part's finite elements to the junction: stiffness, loads, and springs between parts."""
