"""What a scene is made of: the joint, its parts, and the effects that act on them."""
