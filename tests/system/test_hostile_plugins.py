"""Plug-ins that misbehave: each command ends, says what happened, and leaves no process and no traceback."""

import signal
from pathlib import Path

import numpy as np
import pytest
import tiny_joint
from commands import harness, succeeds, wrong_usage
from plugin_commands import LESS_MEMORY, MORE_MEMORY, THREAD, interrupt, write
from suite_runs import rows_of

import harness.conformance.isolated as isolated
import harness.measurement.solver_descriptions as describing
from harness import InputError
from harness.measurement.solver_descriptions import describe, described
from harness.planning.suite import read_suite
from solvers.registry import solver_version

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("without_report")]


@pytest.mark.parametrize(
    ("in_solve", "limit", "said"),
    [
        ("os._exit(0)", (), "ended with exit code 0 before its answer"),
        ("while True: pass", ("--time-limit", 0.2), "the test took more than 0.2 s"),
        pytest.param(MORE_MEMORY, LESS_MEMORY, "more than 700 MiB", marks=pytest.mark.starts),
    ],
)
@pytest.mark.usefixtures("own_cache")
def test_check_says_how_a_solver_ended_or_that_it_did_not(
    tmp_path: Path, in_solve: str, limit: tuple[object, ...], said: str
) -> None:
    done = harness("check", "--plugin", write(tmp_path, in_solve=in_solve), *limit)
    assert done.exit_code == 1
    assert said in done.stdout
    assert "[dual]" in done.stdout


@pytest.mark.parametrize(
    ("at_import", "said"),
    [
        ("sys.exit(0)", "importing the file failed with SystemExit: 0"),
        ("os._exit(0)", "importing it: ended with exit code 0"),
    ],
)
@pytest.mark.usefixtures("own_cache")
def test_an_import_that_ends_the_process_is_bad_input(tmp_path: Path, at_import: str, said: str) -> None:
    plugin = write(tmp_path, at_import)
    suite = tiny_joint.write_suite(tmp_path)
    for arguments in (("check",), ("run", suite, "--solver", "mine", "--out", tmp_path / "out")):
        told = wrong_usage(*arguments, "--plugin", plugin)
        assert said in told
        assert "mine.py" in told


@pytest.mark.usefixtures("own_cache")
def test_an_endless_import_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plugin = write(tmp_path, "time.sleep(100)")
    suite = tiny_joint.write_suite(tmp_path, '[[solver]]\nname = "mine"\n', plugin=str(plugin))
    monkeypatch.setattr(describing, "IMPORT_S", 0.2)
    monkeypatch.setattr(isolated, "IMPORT_S", 0.2)
    with pytest.raises(InputError, match=r"took more than 0\.2 s"):
        describe(read_suite(str(suite)))
    with pytest.raises(InputError, match=r"took more than 0\.2 s"):
        isolated.check("mine", plugin, 20, 8192)


#: Forks, threads, and what is to be done at the end of the process; a solver forks once.
LEAVES_AT_IMPORT = f"os.fork()\natexit.register(time.sleep, 60)\n{THREAD}; print('hello' * 10**6)"
LEAVES_IN_SOLVE = f"""{THREAD}; print(lam)
        if not vars(self): self.ran = os.fork() or (os.setsid(), time.sleep(60))"""


@pytest.mark.starts
@pytest.mark.usefixtures("own_cache")
def test_no_thread_or_fork_is_left_behind(tmp_path: Path) -> None:
    plugin = write(tmp_path, LEAVES_AT_IMPORT, LEAVES_IN_SOLVE)
    done = harness("check", "--plugin", plugin, "--time-limit", 20)
    assert (done.exit_code, done.stdout) == (0, "mine: no faults\n")
    suite = tiny_joint.write_suite(tmp_path)
    succeeds("run", suite, "--plugin", plugin, "--solver", "mine", "--out", tmp_path / "out")
    assert [row["verdict"] for row in rows_of(tmp_path / "out")] == ["within"]


@pytest.mark.usefixtures("own_cache")
def test_a_solver_that_goes_to_another_folder_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plugin, suite = write(tmp_path, in_solve="os.chdir('/')"), tiny_joint.write_suite(tmp_path)
    monkeypatch.chdir(tmp_path)
    succeeds("run", suite, "--plugin", plugin, "--solver", "mine", "--out", "out")
    assert [row["verdict"] for row in rows_of(tmp_path / "out")] == ["within"]


@pytest.mark.usefixtures("own_cache")
def test_a_plug_in_that_adds_a_folder_of_code_is_the_one_described(tmp_path: Path) -> None:
    """What it imports from there is part of its version."""
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "added_code.py").touch()
    plugin = write(tmp_path, f"sys.path.insert(0, {str(tmp_path / 'more')!r}); import added_code")
    suite, out = tiny_joint.write_suite(tmp_path), tmp_path / "out"
    succeeds("run", suite, "--plugin", plugin, "--solver", "mine", "--out", out)
    assert [row["verdict"] for row in rows_of(out)] == ["within"]


def test_a_plug_in_has_the_version_of_the_distribution_that_it_names(tmp_path: Path) -> None:
    """Behind that of its own files: an upgrade outdates its rows."""
    (tmp_path / "mine.py").write_text(tiny_joint.EXACT + '\n    distribution = "numpy"\n')
    (found,) = described([("mine", {})], tmp_path / "mine.py", "test")
    assert found.version == f"{solver_version('mine', tmp_path / 'mine.py')} numpy=={np.__version__}"


PRINTING = "\n    def __init__(self, prints=True):\n        self.prints = prints\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (tiny_joint.EXACT.replace('("dual",)', '"dual"'), "solver mine: forms"),
        (tiny_joint.EXACT + PRINTING, "solver mine: prints = 'True': Choose another name"),
    ],
    ids=["forms", "prints"],
)
def test_what_no_solver_may_set_is_bad_input(tmp_path: Path, text: str, said: str) -> None:
    """Forms that there are not, and an option of which the run would replace the value without a word."""
    (tmp_path / "mine.py").write_text(text)
    with pytest.raises(InputError, match=said):
        described([("mine", {})], tmp_path / "mine.py", "test")


@pytest.mark.parametrize("name", ["newton", "piqp"])
def test_a_plug_in_with_the_name_of_a_solver_of_the_package_is_bad_input(tmp_path: Path, name: str) -> None:
    """Before anything is measured, as that solver or not at all."""
    plugin = tmp_path / f"{name}.py"
    plugin.write_text(tiny_joint.EXACT)
    suite, out = tiny_joint.write_suite(tmp_path), tmp_path / "out"
    done = harness("run", suite, "--plugin", plugin, "--solver", name, "--out", out)
    assert (done.exit_code, out.exists()) == (2, False)
    assert "is taken by a solver of the package: rename the file" in done.stderr


@pytest.mark.parametrize("what", ["check", "run"])
def test_an_interrupt_ends_what_sleeps(tmp_path: Path, what: str) -> None:
    """While a solver sleeps in `check`, and while `run` waits for an import."""
    go = tmp_path / "begun"
    begin = f"open({str(go)!r}, 'w'); time.sleep(60)"
    suite = tiny_joint.write_suite(tmp_path)
    plugin = write(tmp_path, *(("", begin) if what == "check" else (begin,)))
    arguments = [] if what == "check" else [suite, "--solver", "mine", "--out", tmp_path / "out"]
    interrupt([what, *arguments, "--plugin", plugin], go, signal.SIGINT)


#: What breaks the contract, and what is said of it; the last one spoils the cache.
BREACHES = {
    "Answer('solved', lam + 1j)": "wanted real numbers",
    "problem.Q.fill(0)": "read-only",
    "problem.assembly.A.data.fill(0)": "read-only",
    "problem.prepared.assembly.K.factors[0].fill(0)": "read-only",
    "load.p.fill(0)": "read-only",
    "np.load(problem.Q.filename, mmap_mode='r+').fill(1e-6)": "wrote into the cache: delete",
}


@pytest.mark.usefixtures("own_cache")
def test_a_run_goes_on_after_a_solver_that_breaks_the_contract(tmp_path: Path) -> None:
    plugin = write(tmp_path, in_solve="return eval(self.what) or Answer('solved', lam)")
    plugin.write_text(plugin.read_text() + "\n    def __init__(self, what=''):\n        self.what = what\n")
    entry = '[[solver]]\nname = "mine"\nvariant = "{}"\noptions = {{ what = "{}" }}\n'
    text = "".join(entry.format(k, what) for k, what in enumerate(BREACHES))
    done = harness("run", tiny_joint.write_suite(tmp_path, text, plugin="mine.py"), "--out", tmp_path / "out")
    rows = rows_of(tmp_path / "out")
    assert done.exit_code == 3
    assert {(row["status"], row["verdict"]) for row in rows} == {("failed", "no_answer")}
    for row, said in zip(rows, BREACHES.values(), strict=True):
        assert said in row["message"]
