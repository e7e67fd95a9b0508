"""Commands that write directories, as functions: the command line and Python both call them."""
