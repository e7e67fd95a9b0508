"""A page on which fasteners move and the gap follows."""
