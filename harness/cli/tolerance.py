"""The command `tolerance`: `series --find`, by the name of its question."""

from pathlib import Path
from typing import Annotated, Any

from . import options
from .options import option
from .series import series


def tolerance(
    scene: options.SceneName,
    out: Annotated[Path, option("DIR", "Output directory.")],
    key: Annotated[str, option("KEY", "A number of an effect, as initial_gap.random.sd.")],
    span: Annotated[str, option("LOW:HIGH", "The range of its values.", "--range")],
    allow_gap: Annotated[float, option("MM", "The largest gap allowed.", min=0.0)],
    share: options.Share = None,
    resolution: options.Resolution = None,
    cases: options.Cases = None,
    seed: options.Seed = None,
    scheduler: options.Scheduler = None,
) -> None:
    """Find the largest or least value of a key that keeps a gap limit in a share of the joints.

    The end of the range that keeps the share decides which. Each value that is tried is a series of the same
    load cases, with proven gaps; fresh cases then show the share at the value that is found. A key may change
    K. Run the same command again, and it continues. `series --find` is the same with all options of `series`.

    \b
    Examples:
      python -m harness tolerance joint.toml --key initial_gap.random.sd --range 0.01:0.5 --allow-gap 0.3 \\
                                             --share 0.95 --out results/sd

    \b
    Exit codes: 0 a value or the whole range keeps it, 2 wrong usage or bad input, 3 undecided cases prevent a
                verdict, 4 neither end of the range keeps it, or fresh cases contradict the value,
                130 interrupted.
    """
    given: Any = {"check": 0, "scheduler": scheduler, "allow_gap": allow_gap}
    series(scene, out, cases, seed, find=f"{key}={span}", share=share, resolution=resolution, **given)
