"""The documents: what they show works as written, their tables are those of the code, their paths exist."""

import re
import subprocess
import sys
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from commands import harness
from matplotlib.image import imread
from refusals import refusal_of
from rich.console import Console
from typer.main import get_command

from harness import api, check_solver, terminal
from harness.cli.app import app
from harness.scene.solve import solve_into
from problems import effects
from problems.build import load_case
from problems.formats import FORMATS
from problems.model.effect_tables import effect_class, effect_kinds
from problems.model.joint_model import JointModel
from problems.scene_files import SCENES, read_scene
from solvers.plugin import load_plugin

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted(DOCS.rglob("*.md"))]
PAGE = (DOCS / "effects.md").read_text("utf-8")
PUBLISHED = "results/published"
FASTENERS = ("clamps", "fasteners", "installed_fasteners")  # their units are in a table of their own
COMMON = ("kind", "name")  # of all kinds
COMMANDS = get_command(app).commands  # type: ignore[attr-defined]
JOINT = re.search(r"```toml\n(.*?)```", PAGE, re.DOTALL)


def test_the_scene_of_the_page_is_drawn_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its parts meet; the borders of the pictures are white, so that no title is cut."""
    monkeypatch.setattr("report.figures.style.DPI", 160)
    (tmp_path / "scene.toml").write_text(JOINT[1])
    assert solve_into(str(tmp_path / "scene.toml"), None, 1e-9, tmp_path, Console(file=StringIO())) == 0
    for name in ("gap", "section", "forces", "displacement"):
        picture = imread(tmp_path / f"{name}.png")[:, :, :3]
        for border in (picture[:3], picture[-3:], picture[:, :3], picture[:, -3:]):
            assert (border == 1.0).all()


def test_the_new_effects_of_the_page_are_short_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Put into a folder of effects, they are known to scenes, messages and loads by their names alone."""
    files = re.findall(r"```python\n# problems/effects/(\w+)\.py\n(.*?)```", PAGE, re.DOTALL)
    assert [name for name, _ in files] == ["line_load", "sealant_pressure"]
    monkeypatch.setattr(effects, "__path__", [*effects.__path__, str(tmp_path)])
    for name, code in files:
        assert len(code.splitlines()) <= 42
        (tmp_path / f"{name}.py").write_text(code)
        monkeypatch.setitem(sys.modules, f"problems.effects.{name}", None)
        del sys.modules[f"problems.effects.{name}"]
    line = '[[effect]]\nkind = "line_load"\npart = "skin"\nvalue = 0.5\nx = 45.0\nstart = -60\nstop = 40.0\n'
    area = '[[effect]]\nkind = "sealant_pressure"\npressure = 0.5\nx = [45.0, 67.0]\ny = [20.0, 40.0]\n'
    (tmp_path / "scene.toml").write_text(JOINT[1] + line + area)
    scene = read_scene(str(tmp_path / "scene.toml"))
    *_, load, apart = scene.effects
    skin = JointModel.of(scene).parts[1].plate
    rigid = np.kron(np.tile([1.0, 0.0], len(skin.y)), np.tile([1.0, 0.0], len(skin.x)))
    assert load.load(JointModel.of(scene).parts[1]) @ rigid == pytest.approx(50.0, rel=1e-12)
    assert (load_case(scene, "sparse").f != load_case(scene, "sparse", [*scene.effects[:-2], apart]).f).any()
    assert scene.marks()[-6:].tolist()[:4] == [[45.0, 0.0], [45.0, 40.0], [45.0, 20.0], [45.0, 40.0]]
    on_doubler, on_skin = np.split(apart.force(scene.joint), 2)
    moments = on_skin @ np.column_stack([np.ones(len(on_skin)), scene.joint.nodes])
    np.testing.assert_allclose(moments, [220.0, 220.0 * 56.0, 220.0 * 30.0], rtol=1e-12)
    np.testing.assert_array_equal(on_doubler, -on_skin)
    (tmp_path / "bad.toml").write_text(JOINT[1] + (line + area).replace("40.0", "121.0"))
    said = str(refusal_of(read_scene, str(tmp_path / "bad.toml")))
    assert "(line_load).x, stop = [45.0, 121.0]: on the part" in said
    assert "(sealant_pressure).x, y = [[45.0, 67.0], [20.0, 121.0]]: on the junction" in said


@pytest.mark.parametrize("kind", effect_kinds())
def test_the_table_names_every_parameter_with_its_default_and_unit(kind: str) -> None:
    row = next(line for line in PAGE.splitlines() if line.startswith(f"| `{kind}` |"))
    fields = {name: field for name, field in effect_class(kind).model_fields.items() if name not in COMMON}
    assert set(re.findall(r"`(\w+)", row.split("|", 3)[3])) - {"file"} == fields.keys() - {"file"}
    for name, field in fields.items():
        if isinstance(field.default, float) and field.default:
            stated = re.search(rf"`{name}` = (\S+)", row)
            assert float(stated[1].rstrip(";,")) == field.default
        for unit in field.metadata:
            assert not isinstance(unit, str) or unit.replace("1/mm", "mm") in row or kind in FASTENERS


def test_every_scene_of_the_gallery_is_shown_with_its_command_and_pictures() -> None:
    for path in (SCENES / "gallery").glob("*.toml"):
        name = path.stem
        assert f"python -m harness solve gallery/{name} --out docs/gallery/{name}\n" in PAGE
        page = (DOCS / "gallery" / name / "answer.md").read_text("utf-8")
        assert page.startswith(f"# {read_scene(f'gallery/{name}').title}\n")
        for picture in re.findall(r"\]\((\w+\.png)\)", page):
            assert (DOCS / "gallery" / name / picture).is_file()
    for picture in re.findall(r"\]\((gallery/\S+)\)", PAGE):
        assert (DOCS / picture).is_file()


def test_the_formats_of_the_page_are_those_of_the_code() -> None:
    stated = re.findall(r"^\| `(\w+)` \|", PAGE[PAGE.index("## Matrices") :], re.MULTILINE)
    assert stated == list(FORMATS)


def anchors(page: Path) -> set[str]:
    """The headings of a page as GitHub links to them."""
    headings = re.findall(r"^#+ (.+)$", page.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


@each_page
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text("utf-8")):
        path, _, anchor = target.partition("#")
        if "://" not in target:
            linked = page.parent / path if path else page
            assert linked.exists(), target
            assert not anchor or anchor in anchors(linked), target


@pytest.mark.parametrize("page", [page for page in PAGES if page.name != "CHANGELOG.md"], ids=str)
def test_no_sentence_has_more_than_thirty_words(page: Path) -> None:
    """Of what a user reads: words with letters, code in a sentence as one, a colon or semicolon ends one."""
    text = re.sub(r"(?s:```.*?```)|^ {4}.*$", "", page.read_text("utf-8"), flags=re.MULTILINE)
    text = re.sub(r"!?\[([^]]*)\]\([^)]*\)", r"\1", text)
    for block in re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.)\s|#)|\|", text):
        for sentence in re.split(r"(?<=[.!?:;])\s+", re.sub(r"`[^`]*`", "code", " ".join(block.split()))):
            assert len(re.findall(r"\S*[^\W\d_]\S*", sentence)) <= 30, sentence


@each_page
def test_the_lines_of_tables_are_not_joined(page: Path) -> None:
    for line in page.read_text("utf-8").splitlines():
        assert "|-" not in line or re.fullmatch(r"\s*[-|: ]+", line), line


@each_page
def test_paths_of_code_exist(page: Path) -> None:
    """`harness/….py`, `problems/effects/`; not those with a <name> to fill in."""
    folders = "harness|problems|solvers|report|tests|examples"
    for path in re.findall(rf"`((?:{folders})/[\w./-]*(?:\.py|\.toml|/))`", page.read_text("utf-8")):
        assert (ROOT / path).exists(), path


def test_the_folders_and_files_of_the_architecture_are_those_of_the_code() -> None:
    page = (DOCS / "architecture.md").read_text("utf-8")
    tree = page[page.index("## The tree") : page.index("## Where do I find")]
    for package in ("problems", "solvers", "harness", "report"):
        part = re.split(r"\n(?=\w)", tree[tree.index(f"\n{package}/") + 1 :])[0]
        for path in re.findall(rf"(?<![\w/]){package}/[\w/]+\.py", page):
            assert (ROOT / path).is_file(), path
        for folder in (ROOT / package).iterdir():
            if folder.is_dir() and folder.name != "__pycache__" and any(folder.iterdir()):
                assert f"{folder.name}/" in part, f"{package}/{folder.name}"


def test_the_exit_codes_and_commands_of_the_page_are_those_of_the_code() -> None:
    text = (DOCS / "commands.md").read_text("utf-8")
    table = text[text.index("| exit code |") :].split("\n\n")[0]
    codes = {value for name, value in vars(terminal).items() if name.isupper()}
    assert {int(code) for code in re.findall(r"^\| (\d+) \|", table, re.MULTILINE)} == codes
    for name in COMMANDS:
        assert f"| `python -m harness {name} " in text, name


@each_page
def test_commands_of_a_page_exist_with_their_options(page: Path) -> None:
    """Up to the end of the line, or of the code in a sentence. CHANGELOG tells of what is gone, too."""
    for call in re.findall(r"python -m harness ([a-z]+[^`\n&|#]*)", page.read_text("utf-8")):
        name, *words = call.split()
        if page.name != "CHANGELOG.md":
            known = {option for param in COMMANDS[name].params for option in param.opts}
            assert {word for word in words if word.startswith("--")} <= known, call


def test_the_tutorial_of_shims_says_what_its_commands_say(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the scan to the drawing, in an empty folder beside the examples; the reports are left out."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.setattr("report.writers.answer_report.write", Path)
    monkeypatch.setattr("report.writers.shim_report.write", Path)
    monkeypatch.chdir(tmp_path)
    page = (DOCS / "shims.md").read_text("utf-8").replace("\\\n", "")
    steps = re.findall(r"```sh\npython -m harness (.*)\n```\n\n```text\n(.*)\n```", page)
    assert len(steps) >= 4
    for command, said in steps:
        assert said in " ".join(harness(*command.split()).output.split())


def test_the_main_suite_takes_as_long_on_every_page() -> None:
    text = (DOCS / "suites.md").read_text("utf-8")
    table = re.search(r"^\| `default` \|.*\| (\d+) min \|$", text, re.MULTILINE)
    assert table is not None
    readme = (ROOT / "README.md").read_text("utf-8")
    assert f"run the main suite ({table[1]} minutes on two cores)" in readme
    assert f"the suite `default` ({table[1]} minutes)" in str(get_command(app).help)


@pytest.mark.usefixtures("without_pictures", "without_report")
def test_the_python_of_the_page_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """All blocks, one after another, in an empty folder beside the examples."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for code in re.findall(r"```python\n(.*?)```", (DOCS / "python.md").read_text("utf-8"), re.DOTALL):
        exec(code, names)
    lines = capsys.readouterr().out.splitlines()
    assert lines[2] == "outside 1e-06 mm"
    assert [line.split(":")[0] for line in lines if line[:4] in ("PASS", "FAIL")] == ["PASS", "PASS"]
    assert lines[-4:-1] == ["[]", "within", "True"]


def test_the_bound_of_the_page_is_one(capsys: pytest.CaptureFixture[str]) -> None:
    code = re.search(r"```python\n(.*?)```", (DOCS / "proof.md").read_text("utf-8"), re.DOTALL)
    assert code is not None
    exec(code[1], {})
    error, bound = map(float, capsys.readouterr().out.split(" is at most "))
    assert 1e-6 < error < bound < 100 * error


def test_the_solver_of_the_readme_works(tmp_path: Path) -> None:
    """Within 1e-7 mm, as is said of it, and as the template is."""
    code = re.search(r"```python\n(# mine\.py\n.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL)
    assert code is not None
    (tmp_path / "mine.py").write_text(code[1])
    for path in (tmp_path / "mine.py", ROOT / "examples" / "my_solver.py"):
        solver = load_plugin(path)
        assert check_solver(solver) == []
        answer = api.solve("scaling/1170", solver())
        assert (answer.status, answer.judgement.verdict) == ("solved", "within")


def test_what_is_published_in_git_is_small() -> None:
    """Rows, the index, the answers and the pictures that documents show: the rest is drawn by `report`."""
    listed = subprocess.run(["git", "ls-files", "-z", PUBLISHED], cwd=ROOT, capture_output=True, text=True)
    files = [ROOT / name for name in listed.stdout.split("\0") if name]
    if not files:
        pytest.skip("no clone with git")
    assert len(files) <= 400
    assert sum(path.stat().st_size for path in files) <= 20e6
    shown = {
        (page.parent / picture).resolve()
        for page in [*PAGES, *(path for path in files if path.suffix == ".md")]
        for picture in re.findall(r"!\[[^]]*\]\(([^)\s]+)\)", page.read_text("utf-8"))
    }
    assert {path for path in files if path.suffix == ".png"} == {
        path for path in shown if PUBLISHED in str(path)
    }
