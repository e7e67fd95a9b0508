"""`run --with NAME==VERSION`: versions of a library, each in an environment of its own; no network."""

import zipfile
from pathlib import Path
from typing import Any

import pytest
import tiny_joint
from commands import harness
from suite_runs import rows_of, said_by

from harness.measurement.environments import COMPLETE
from harness.measurement.suite_run import run as measure
from harness.planning.overrides import Overrides, overridden
from harness.planning.suite import read_suite
from problems import storage

pytestmark = pytest.mark.slow

#: What each version of the library holds. Its solver multiplies the exact answer by FACTOR.
LIBRARY = {"1.0": "import needed\nFACTOR = needed.ONE", "2.0": "factor = 1.0"}
PLUGIN = tiny_joint.EXACT.replace("import numpy", "import fakelib\nimport numpy", 1).replace(
    '"solved", lam', '"solved", fakelib.FACTOR * lam'
)


def write_wheel(folder: Path, name: str, version: str, code: str, *requires: str) -> None:
    folder.mkdir(exist_ok=True)
    info = f"{name}-{version}.dist-info"
    needs = "".join(f"Requires-Dist: {each}\n" for each in requires)
    with zipfile.ZipFile(folder / f"{name}-{version}-py3-none-any.whl", "w") as wheel:
        wheel.writestr(f"{name}.py", code)
        wheel.writestr(
            f"{info}/METADATA", f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n{needs}"
        )
        wheel.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
        wheel.writestr(f"{info}/RECORD", f"{name}.py,,\n{info}/METADATA,,\n{info}/WHEEL,,\n{info}/RECORD,,\n")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("versions")
    write_wheel(folder / "wheels", "fakelib", "1.0", LIBRARY["1.0"], "needed", "numpy")
    write_wheel(folder / "wheels", "needed", "1.0", "ONE = 1.0")
    tiny_joint.write_suite(folder, '[[solver]]\nname = "fake"\n', plugin="fake.py")
    (folder / "fake.py").write_text(PLUGIN)
    return folder


@pytest.fixture(autouse=True)
def _offline(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = {"RIVETBENCH_CACHE": "cache", "PIP_FIND_LINKS": "wheels", "PIP_CONFIG_FILE": "no-file"}
    for name, path in settings.items():
        monkeypatch.setenv(name, str(folder / path))
    monkeypatch.setenv("PIP_NO_INDEX", "1")


def run(folder: Path, out: Path, *versions: str) -> tuple[str, dict[str, dict[str, Any]]]:
    """What is printed, and the rows by their version."""
    asked = tuple(f"fakelib=={version}" for version in versions)
    change = Overrides(solvers=("fake",), requirements=asked)
    code, text = said_by(measure, overridden(read_suite(str(folder / "small.toml")), change), out)
    assert code == 0
    return text, by_version(out)


def by_version(out: Path) -> dict[str, dict[str, Any]]:
    rows = rows_of(out)
    assert len({row["key"] for row in rows}) == len(rows)
    return {row["solver_version"].removeprefix("fakelib=="): row for row in rows}


def marks() -> dict[str, int]:
    return {path.parent.name: path.stat().st_mtime_ns for path in storage.root().glob(f"*/{COMPLETE}")}


def test_versions_side_by_side_and_again(folder: Path, tmp_path: Path) -> None:
    """One is right, one cannot be installed; when it can, it has another interface."""
    out, wanted = tmp_path / "out", ("1.0", "2.0")
    text, rows = run(folder, out, *wanted)
    assert "1 no answer" in text
    assert rows["1.0"]["key"] == "tiny fake dual fakelib==1.0 tol=1e-09 threads=1 repeat=0"
    assert rows["1.0"]["verdict"] == "within"
    assert rows["2.0"]["status"] == "failed"
    assert "fakelib = '2.0': pip cannot install it" in rows["2.0"]["message"]
    assert "No matching distribution found for fakelib==2.0" in rows["2.0"]["message"]
    made = marks()
    assert [name.rpartition("-")[0] for name in made] == ["fakelib==1.0"]

    write_wheel(folder / "wheels", "fakelib", "2.0", LIBRARY["2.0"], "needed")
    assert list(storage.root().glob("fakelib==2.0-*/bin/python"))  # the rest of what failed is no environment
    first, (text, rows) = rows["1.0"], run(folder, out, *wanted)
    assert "2 measurements, 1 of them already" in text
    assert rows["1.0"] == first
    assert made.items() < marks().items()
    assert rows["2.0"]["status"] == "failed"
    assert "no attribute 'FACTOR'" in rows["2.0"]["message"]


def test_another_copy_on_the_path(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "fakelib.py").write_text("FACTOR = 1.0")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    asked = ("--solver", "fake", "--with", "fakelib==1.0", "--out", tmp_path / "out")
    done = harness("run", folder / "small.toml", *asked)
    assert done.exit_code == 3
    row = by_version(tmp_path / "out")["1.0"]
    assert row["status"] == "failed"
    assert f"another copy is imported: {tmp_path / 'fakelib.py'}" in row["message"]
