"""The list of mutants keeps up with the source: each text is there once, and what replaces it is Python."""

import pytest
from mutants import MUTANTS, TESTS, Mutant
from mutate_proofs import ROOT


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: f"{mutant.file}:{mutant.old.strip()}")
def test_a_mutant_is_one_change_of_the_source(mutant: Mutant) -> None:
    source = (ROOT / mutant.file).read_text("utf-8")
    assert source.count(mutant.old) == 1
    assert mutant.new != mutant.old
    compile(source.replace(mutant.old, mutant.new), mutant.file, "exec")


@pytest.mark.parametrize("file", TESTS)
def test_the_tests_that_kill_them_are_there(file: str) -> None:
    assert any(mutant.file == file for mutant in MUTANTS)
    assert all((ROOT / "tests" / name).is_file() for name in TESTS[file])
