"""Which shims close what fastening leaves open: patches, the search for thicknesses, what is written."""
