"""A command of the project in this process, its words as a user types them."""

from typer.testing import CliRunner, Result

from harness.cli.app import app


def harness(*words: object) -> Result:
    return CliRunner().invoke(app, [*map(str, words)])
