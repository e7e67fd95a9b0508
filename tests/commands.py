"""A command of the project in this process, its words as a user types them."""

from io import StringIO

from rich.console import Console
from typer.testing import CliRunner, Result

from harness.cli.app import app
from harness.terminal.console import ConsoleReporter


def harness(*words: object) -> Result:
    """It ends with an exit code, not with a traceback."""
    done = CliRunner().invoke(app, [*map(str, words)])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return done


def onto(text: StringIO) -> ConsoleReporter:
    """A reporter whose sentences come into a text."""
    return ConsoleReporter(Console(file=text, width=200))


def succeeds(*words: object) -> str:
    """What a command says that ends with exit code 0."""
    done = harness(*words)
    assert done.exit_code == 0, done.output
    return done.output


def wrong_usage(*words: object) -> str:
    """What a command says of wrong usage or bad input, in one line."""
    done = harness(*words)
    assert done.exit_code == 2, done.output
    return " ".join(done.stderr.split())
