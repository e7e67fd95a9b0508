"""Arrays on disk under a hash of what made them."""
