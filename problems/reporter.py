"""Tells whoever waits for a command what it is doing."""

from contextlib import AbstractContextManager, nullcontext
from enum import StrEnum


class Stage(StrEnum):
    """A stage of making the dense matrices; one that the cache holds is not made."""

    CONDENSATION = "condensing"
    SPRINGS = "springs between the parts"
    FACTORS = "Cholesky factors of K"
    CONDITION = "condition number"
    Q = "Q = AᵀK⁻¹A"


class Reporter:
    """Is told steps, their progress, and sentences for a person; this base class is silent.

    Examples
    --------
    >>> from rivetbench import Reporter, solve
    >>> class Log(Reporter):
    ...     def say(self, sentence):
    ...         print(f"{sentence}.")
    >>> answer = solve("gallery/three-part-stack", reporter=Log())
    """

    def step(self, name: str) -> AbstractContextManager[None]:
        """Enter a step.

        Parameters
        ----------
        name : str
            What is done in it.

        Returns
        -------
        context manager
            Entered at its beginning, left at its end.
        """
        return nullcontext()

    def progress(self, text: str, fraction: float = 0.0) -> None:
        """Take note of what is done within a step.

        Parameters
        ----------
        text : str
            What is done.
        fraction : float, optional
            How much of it is done, 0 to 1, if that is known.
        """

    def building(self, stage: Stage, fraction: float = 0.0, part: str = "") -> None:
        """Take note that a stage begins or goes on.

        Parameters
        ----------
        stage : Stage
            What is made.
        fraction : float, optional
            How much of it is done, 0 to 1.
        part : str, optional
            The part that it is made of.
        """
        self.progress(f"{stage} {part}".rstrip(), fraction)

    def say(self, sentence: str) -> None:
        """Take note of a sentence that a person should read.

        Parameters
        ----------
        sentence : str
            Without its full stop.
        """


SILENT = Reporter()
