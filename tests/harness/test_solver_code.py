"""The hash of a solver's code: what it does counts, what is said of it does not, nor do other solvers."""

import shutil
import sys
from pathlib import Path

import pytest

from harness.measurement.solver_descriptions import code_of
from problems.storage import ROOT, fingerprint
from solvers.plugin import plugin_files
from solvers.registry import make_solver, modules, solver_version


@pytest.fixture
def package(tmp_path: Path) -> Path:
    ignored = shutil.ignore_patterns("__pycache__")
    return Path(shutil.copytree(ROOT / "solvers", tmp_path / "solvers", ignore=ignored))


def hash_of(file: Path, package: Path) -> str:
    return fingerprint([file], within=["solvers"], root=package.parent)


def change(file: Path, old: str, new: str) -> None:
    text = file.read_text("utf-8")
    assert text.count(old) == 1, f"{file.name} has {text.count(old)} of {old!r}"
    file.write_text(text.replace(old, new), "utf-8")


def hashes(package: Path) -> dict[str, str]:
    files = {name: module.partition(".")[2].replace(".", "/") for name, module in modules().items()}
    return {name: hash_of(package / f"{file}.py", package) for name, file in files.items()}


def changed(package: Path, unchanged: dict[str, str]) -> set[str]:
    return {name for name, now in hashes(package).items() if now != unchanged[name]}


def test_a_copy_elsewhere_has_the_same_hash(package: Path) -> None:
    found = hashes(package)
    assert found["newton"] == code_of(make_solver("newton", {}))
    assert len(set(found.values())) == len(modules())


def test_words_and_layout_do_not_count(package: Path) -> None:
    unchanged = hashes(package)
    for file in package.rglob("*.py"):
        with file.open("a") as added:
            added.write('\n\n# a comment\n\n\ndef _unused() -> None:\n    """Words."""\n')
    added = hashes(package)
    assert changed(package, unchanged) == set(modules())  # a function is code
    for file in package.rglob("*.py"):
        change(file, "# a comment\n\n\n", "# another comment\n")
        change(
            file, '_unused() -> None:\n    """Words."""', '_unused():  # more\n    """Other\n    words."""'
        )
    change(package / "base.py", '"""The interface of a solver:', '"""What is meant by a solver:')
    change(package / "methods/gi.py", 'f"the diagonal of U is zero at {info}"', 'f"U is zero at {info}"')
    change(package / "kkt.py", "def kkt_residual(lam: Vector, y: Vector)", "def kkt_residual(lam, y)")
    assert changed(package, added) == set()


def test_a_constant_two_imports_down_counts_for_those_who_use_it(package: Path) -> None:
    unchanged = hashes(package)
    # ipm → kkt, newton → sweeps → kkt; the libraries do not
    change(package / "kkt.py", "EPS = float(np.finfo(float).eps)", "EPS = 2 * float(np.finfo(float).eps)")
    users = {"ipm", "newton", "textbook-active-set"}
    assert changed(package, unchanged) & {*users, "osqp", "nnls"} == users


def test_a_library_does_not_depend_on_the_solvers_of_the_house(package: Path) -> None:
    unchanged = hashes(package)
    (package / "libraries/osqp.py").write_text("OTHER = 1\n")
    (package / "methods/newton.py").write_text("OTHER = 1\n")
    assert changed(package, unchanged) == {"osqp", "newton"}
    (package / "adapter.py").write_text("OTHER = 1\n")
    users = {"osqp", "newton", "piqp", "nnls"}
    assert changed(package, unchanged) & {*users, "gi"} == users


@pytest.mark.parametrize(
    "line",
    [
        "from solvers.kkt import EPS",
        "from solvers import kkt",
        "import solvers.kkt as k",
        "def solve():\n    from solvers.kkt import EPS",
    ],
)
def test_a_plugin_depends_on_what_it_imports(package: Path, tmp_path: Path, line: str) -> None:
    mine, alone = tmp_path / "mine.py", tmp_path / "alone.py"
    mine.write_text(f"import numpy as np\nfrom solvers.base import Solver\n{line}\n")
    alone.write_text("import numpy as np\nfrom solvers.base import Solver\n")
    before = [hash_of(file, package) for file in (mine, alone)]
    (package / "kkt.py").write_text("EPS = 0.0\n")
    after = [hash_of(file, package) for file in (mine, alone)]
    assert [a == b for a, b in zip(after, before, strict=True)] == [False, True]


HELPED = """
import sys
from pathlib import Path
sys.path.insert(0, str(Path(__file__).parent / "lib"))
from solvers.base import Answer, Solver

class Helped(Solver):
    forms = ("dual",)
    def solve(self, ready, load, tolerance):
        {line}
        return Answer("solved", load.p * 0)
"""


@pytest.mark.parametrize(
    ("line", "helper"),
    [
        ("import helper", "helper.py"),
        ("import importlib; h = importlib.import_module('helper')", "helper.py"),
        ("exec(Path(__file__).with_name('my-helper.py').read_text())", "my-helper.py"),
        ("import far", "lib/far.py"),
        ("import package.module", "package/__init__.py"),
        ("from package.module import f", "package/deep.py"),  # package.module imports it
        ("from package import module", "package/module.py"),
        ("import compiled", "compiled.so"),
        ("import broken", "broken.py"),
    ],
)
def test_helpers_of_a_plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str, helper: str) -> None:
    """In the fingerprint and in the version, however lazily it is imported; other files do not count."""
    monkeypatch.setattr("sys.path", [str(tmp_path), *sys.path])
    files = ["helper.py", "my-helper.py", "lib/far.py", "compiled.so", "other.py", "data.json"]
    files += [f"package/{name}.py" for name in ("__init__", "module", "deep", "other")]
    for name in files:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("def f(): return 1\n")
    (tmp_path / "package" / "module.py").write_text("def f():\n    from .deep import f\n    return f()\n")
    (tmp_path / "broken.py").write_text("def f( return 1\n")
    mine = tmp_path / "mine.py"
    mine.write_text(HELPED.format(line=line))

    def identity() -> tuple[str, str]:
        return code_of(make_solver("mine", {}, mine)), solver_version("mine", mine)

    unchanged = identity()
    for name in ("other.py", "data.json", "package/other.py"):
        (tmp_path / name).write_text("def f(): return 2\n")
    assert identity() == unchanged
    text = (tmp_path / helper).read_text()
    (tmp_path / helper).write_text(text + "\nx = 2\n")
    assert [now == then for now, then in zip(identity(), unchanged, strict=True)] == [False, False]


def test_what_is_installed_and_the_project_is_not_a_plugins_own(tmp_path: Path) -> None:
    mine = ROOT / "examples" / "my_solver.py"
    assert plugin_files(mine) == [mine]
    alone = tmp_path / "alone.py"
    alone.write_text("import numpy.linalg\nfrom solvers import kkt\nfrom ........ import x\n")
    assert plugin_files(alone) == [alone.resolve()]
