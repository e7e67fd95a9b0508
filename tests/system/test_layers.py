"""The folders import each other in one direction only: the contracts of pyproject.toml."""

import pytest
from importlinter.cli import lint_imports

from harness.results.provenance import ROOT


def test_no_import_goes_against_the_layers(capsys: pytest.CaptureFixture[str]) -> None:
    code = lint_imports(config_filename=str(ROOT / "pyproject.toml"), cache_dir=None)
    assert code == 0, capsys.readouterr().out
