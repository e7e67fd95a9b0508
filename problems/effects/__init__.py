"""Effects: one file per physical effect, with its parameters and the term that it adds."""
