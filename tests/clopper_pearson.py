"""The exact interval for a share, by quantiles of beta distributions."""

from scipy.stats import beta


def interval_of(kept: int, count: int) -> tuple[float, float]:
    """With 95 % confidence, of `kept` of `count` cases."""
    low = 0.0 if kept == 0 else float(beta.ppf(0.025, kept, count - kept + 1))
    return low, 1.0 if kept == count else float(beta.ppf(0.975, kept + 1, count - kept))
