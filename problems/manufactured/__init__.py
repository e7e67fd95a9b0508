"""Problems whose answers are known without a solver, and the ladders made of them."""
