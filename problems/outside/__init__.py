"""Problems that others wrote, with printed optima or closed forms: each file is one, in several sizes."""
