"""A coarser model of a part, for a preconditioner: fewer grid lines beyond the junction.

With K̂' = PᵀK̂P, where P interpolates in a subset of the grid lines y = const, the compliance of the junction
changes little (on long parts by 5e-4 of itself, on short strips by up to 1e-2) if the lines are close
together near the junction, where the short waves are, and those of stiff beams and supports are kept. A band
across the part is then half as wide, and what costs its cube an eighth.
"""

from dataclasses import replace

import numpy as np

from .part import PartModel

GROWTH = 1.2  # of the distance between lines, away from the junction
PEAK = 2.0  # times the median beyond the junction: the stiffness that effects add to a line that is kept


def graded(model: PartModel) -> PartModel:
    """The same part with fewer grid lines beyond its junction."""
    first, last, end = model.junction.start, model.junction.stop - 1, len(model.plate.y) - 1
    kept = set(model.junction) | {first - k for k in _graded(first)} | {last + k for k in _graded(end - last)}
    kept |= _stiff_lines(model)
    lines = sorted(kept)
    place = {line: k for k, line in enumerate(lines)}
    return replace(
        model,
        plate=replace(model.plate, y=model.plate.y[lines]),
        junction=range(place[first], place[last] + 1),
        clamped=frozenset(place[line] for line in model.clamped),
    )


def _graded(count: int) -> list[int]:
    """Distances 1, 2, … up to `count`, in lines, with growing steps."""
    steps = (GROWTH ** np.arange(count)).astype(int)
    return [*np.cumsum(steps)[np.cumsum(steps) < count].tolist(), count] if count else []


def _stiff_lines(model: PartModel) -> set[int]:
    """The lines to which effects add far more stiffness than to others: beams along them, and supports."""
    added = model.added.diagonal().reshape(len(model.plate.y), 2, -1, 2)[:, 0, :, 0].sum(axis=1)
    beyond = np.delete(added, model.junction)
    return set(np.flatnonzero(added > PEAK * np.median(beyond)).tolist()) if beyond.size else set()
