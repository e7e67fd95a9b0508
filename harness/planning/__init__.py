"""From a suite to the list of measurements."""
