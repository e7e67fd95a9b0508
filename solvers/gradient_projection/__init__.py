"""Building blocks of the methods that project gradients."""
