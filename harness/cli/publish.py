"""The command `publish`: all published results, measured from one commit."""

from __future__ import annotations

import signal
import subprocess
import sys
from typing import Annotated, Any

import typer

from harness.terminal.console import error_reporting

app = typer.Typer(rich_markup_mode=None)

PATIENCE_S = 10.0  # for a command that was interrupted with this one


@app.command()
def publish(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAMES...]", help="Only these suites, or `gaps`.")
    ] = None,
) -> None:
    """Measure every published suite with this commit, into results/published, and write an index.

    Takes hours. In a clone without changes to the code: commits of results and documents do not count as
    another code, nor do those of reports. Of what is published with it already, only the report is written
    anew; what was published before stays until the new rows are whole. Stop with Ctrl-C and run the same
    command again to continue.

    \b
    Examples:
      python -m harness publish
      python -m harness publish speed series

    \b
    Exit codes: 0 all published, 1 a suite is not whole, 2 wrong usage, or code that has changes,
                130 interrupted.
    """
    with error_reporting() as console:
        from harness.planning.suite import read_suite
        from harness.results import published as results
        from harness.terminal.exit_codes import DONE, FAILED, INTERRUPTED
        from report.writers.published import write_index

        code = results.code_to_publish()
        chosen = results.chosen(names or [])
        before = {name: results.rows_of(results.PUBLISHED / name) for name in chosen}
        due = [name for name in chosen if not results.is_of(before[name], code)]
        for name in due:
            if name not in results.SERIES:
                read_suite(name)  # refuses solvers that are not installed, now rather than in hours
        done = [name for name in chosen if name not in due]
        for name in done:
            console.print(f"Published already, with commit {code}: {name}", style="dim")
            if name in results.SERIES:  # whose pictures need its gaps, which are not published
                continue
            if _ended(["report", str(results.PUBLISHED / name)]) == INTERRUPTED:
                raise KeyboardInterrupt
        failed = []
        for k, name in enumerate(due):
            console.print(f"Suite {k + 1} of {len(due)}: {name}. {_left({n: before[n] for n in due[k:]})}")
            directory = results.staged(name, code)
            if ended := _ended(results.command(name, directory)):
                if ended == INTERRUPTED:
                    raise KeyboardInterrupt
                failed.append(name)
            elif not results.is_of(results.rows_of(directory), code):
                console.print(f"{directory}: not all rows are of commit {code}, without changes", style="red")
                failed.append(name)
            else:
                results.publish(name, directory, results.PUBLISHED)
                console.print(f"Published: {results.PUBLISHED / name}")
        if results.PUBLISHED.is_dir():
            console.print(f"Index: {write_index(results.PUBLISHED)}")
        if failed:
            console.print(f"Not published: {', '.join(failed)}. Run the same command again.", style="red")
        raise typer.Exit(FAILED if failed else DONE)


def _left(rows: dict[str, list[dict[str, Any]]]) -> str:
    """The time left, as long as these took when they were last published."""
    from harness.results.published import seconds

    known = {name: taken for name, some in rows.items() if (taken := seconds(some)) is not None}
    unknown = [name for name in rows if name not in known]
    words = f"About {sum(known.values()) / 60:.0f} minutes left" if known else "Time left not known"
    return words + (f", without {', '.join(unknown)}." if known and unknown else ".")


def _ended(command: list[str]) -> int:
    """The exit code of a command of this program, in a process of its own, which ends before this one."""
    from harness.results.provenance import ROOT

    with subprocess.Popen([sys.executable, "-m", "harness", *command], cwd=ROOT) as child:
        signal.signal(signal.SIGTERM, lambda *_: child.terminate())
        while True:
            try:
                return child.wait()
            except KeyboardInterrupt:  # of the terminal: the child has it, too
                try:
                    return child.wait(PATIENCE_S)
                except subprocess.TimeoutExpired:
                    child.terminate()
