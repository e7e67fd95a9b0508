"""The list of mutants keeps up with the source: each text is there once, and what replaces it is Python."""

import ast

import pytest
from mutants import CHANGES, TESTS
from mutate_proofs import ROOT


@pytest.mark.parametrize("file", CHANGES)
def test_a_mutant_is_one_change_of_the_source(file: str) -> None:
    source = (ROOT / file).read_text("utf-8")
    for old, changed in CHANGES[file].items():
        assert source.count(old) == 1, old
        for new in changed:
            assert new != old
            ast.parse(source.replace(old, new), file)


def test_the_tests_that_kill_them_are_there() -> None:
    assert set(TESTS) == set(CHANGES)
    assert all((ROOT / "tests" / name).is_file() for names in TESTS.values() for name in names)
