"""The paper's tables and figures beside ours, and its claims: for the suite `paper` only."""
