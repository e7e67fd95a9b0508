"""Measures a suite into a directory, and reports on a directory again."""

from dataclasses import dataclass
from pathlib import Path

from harness.measurement.recorded_suite import SUITE
from harness.measurement.scheduler import threads_per_worker
from harness.measurement.suite_run import run as run_suite
from harness.planning.overrides import Overrides, overridden
from harness.planning.suite import read_suite, read_written, suite_names
from harness.results import records
from harness.results.atomic_output import refuse_inputs, refuse_unwritable
from harness.results.records import MEASUREMENTS, Row
from harness.results.row_validation import refuse_unreadable
from harness.results.schema import SERIES
from harness.results.series_file import refuse_damaged
from harness.terminal.console import console_of
from problems.reporter import SILENT, Reporter

AS_IT_IS = Overrides()


@dataclass(frozen=True)
class SuiteOutcome:
    """A measured suite in its directory.

    Parameters
    ----------
    directory : Path
        Where its rows, answers and report are.
    code : int
        Exit code of the command: 0 measured, 1 workers were lost, 3 no row has an answer that can be judged.
    report : Path, optional
        The report, in Markdown; None if nothing was measured.
    """

    directory: Path
    code: int
    report: Path | None

    @property
    def rows(self) -> list[Row]:
        """One row per measurement, with the columns of docs/columns.md."""
        return records.read(self.directory / MEASUREMENTS)


def run(
    suite: str | Path = "default",
    out: str | Path | None = None,
    change: Overrides = AS_IT_IS,
    *,
    scheduler: str | None = None,
    key: str | None = None,
    reporter: Reporter = SILENT,
) -> SuiteOutcome:
    """Measure a suite: a process per measurement, its answer judged, a row for each, and the report.

    Parameters
    ----------
    suite : str or Path, optional
        Name of a suite, path of its TOML file, or a directory that `run` wrote.
    out : str or Path, optional
        Output directory, by default results/SUITE, or the directory that is given as `suite`; the same call
        continues what was interrupted.
    change : Overrides, optional
        What to change in the suite.
    scheduler : str, optional
        Dask workers: local:N, or the address of a scheduler; by default this machine.
    key : str, optional
        Only the row with this key, measured again after its earlier repeats.
    reporter : Reporter, optional
        With the console of a ConsoleReporter, rows are shown as they come; silent by default.

    Returns
    -------
    SuiteOutcome
        Where the rows are, and the report.

    Raises
    ------
    InputError
        If the suite is wrong; if `out` holds something else, has rows to come of another suite, or the row
        of `key`.

    Examples
    --------
    >>> from rivetbench import Overrides, run
    >>> change = Overrides(scenes=("gallery/heavy-sheet-on-tool",), solvers=("gi",), forms=("dual",))
    >>> outcome = run("gate", "results/gi", change)
    >>> {row["verdict"] for row in outcome.rows}
    {'within'}
    """
    written = Path(suite) / SUITE
    again = written.is_file() and str(suite) not in suite_names()
    read = read_written(written) if again else read_suite(str(suite))
    chosen = overridden(read, change)
    if not change.threads and "threads" not in read.model_fields_set:
        threads = [threads_per_worker(scheduler) or chosen.threads[0]]
        chosen = chosen.model_copy(update={"threads": threads})
    directory = Path(out or (suite if again else Path("results") / chosen.name))
    if not (directory / MEASUREMENTS).exists():
        refuse_inputs([directory / SUITE], [Path(suite)])
    code = run_suite(chosen, directory, console_of(reporter), scheduler, key)
    if not (directory / MEASUREMENTS).is_file():
        return SuiteOutcome(directory.absolute(), code, None)
    from report.writers.suite_report import write  # slow to import: not before the first row

    return SuiteOutcome(directory.absolute(), code, write(directory))


def report(directory: str | Path) -> Path:
    """Write the report of a run or of a series again, from its rows.

    Parameters
    ----------
    directory : str or Path
        A directory that `run` or `run_series` wrote.

    Returns
    -------
    Path
        The report, in Markdown; a page for a browser is beside it.

    Raises
    ------
    InputError
        If the directory has no rows, or damaged ones.

    Examples
    --------
    >>> from rivetbench import report, run_series
    >>> done = run_series("gallery/installed-fasteners", "results/tips", sweep=["initial_gap.mean=0.6,0.7"])
    >>> report("results/tips").name
    'report.md'
    """
    directory = Path(directory)
    if directory.is_dir():
        refuse_unwritable(directory / "report", (), "DIR")
    if (directory / SERIES).exists():
        from report.writers.series_report import write as write_series

        refuse_damaged(directory)
        return write_series(directory)
    refuse_unreadable(directory)
    if (directory / SUITE).is_file():
        read_written(directory / SUITE)
    from report.writers.suite_report import write

    return write(directory)
