"""The paper's tables and figures beside ours, and its claims: shown for the suite `paper` alone."""
