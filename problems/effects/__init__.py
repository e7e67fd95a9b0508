"""Effects: each file is one physical effect, its parameters and the one term that it adds."""
