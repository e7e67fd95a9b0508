"""Files of other programs in all their spellings: the right gaps, or a sentence that names the file, or both.

60 draws; RIVETBENCH_LONG=1 takes 20 000, RIVETBENCH_LONG=N takes N.
"""

import io
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as sla
from commands import onto
from edge_draws import OUTCOMES, Draw, abaqus, dmig, encoded, matrix_market, npz, op4, table
from sample_size import Fault, Log, draws
from scipy.interpolate import RegularGridInterpolator
from small_problems import by_nnls

from harness.api import load_scene, own_matrices, random_gaps, solve
from harness.scene.import_files import import_matrices
from harness.scene.judge_file import read_answer
from problems.build import load_case, prepared
from problems.errors import InputError
from problems.load_cases.measured_gaps import measured_gaps

SEED, PARTS = 57, 4
PLAIN = (0.7, 0.85, 0.95)  # shares of usual spellings
TIME_LIMIT_S = 20
CLOSE = 1e-9  # mm
MARKS = (9999.0, -9999.0, 32767.0, 1e30, 1e36, -1.0, -999.0, 99999.0)
WORDS = ("", "NaN", "n/a", "-", "#N/A", "---")
MOST_LINES = 11  # of a message: ten faults, and how many more
PYTHON = re.compile(
    r"\b\w+(Error|Exception|Warning)\b|Traceback|codec|dtype|literal|NoneType|object at|numpy"
)
ORIGINS = ((0, 0), (10, 40), (1200, 2300), (-30, 1000))
Array = Any
Task = tuple[Array, Callable[[], tuple[Array, list[str]]]]  # the right gaps; reads them, with what is said


def gaps_of(K: Array, A: Array, f: Array, g: Array) -> Array:
    """g − Aᵀx of min ½xᵀKx − fᵀx, Aᵀx ≤ g, by nothing of the project."""
    Q, p = A.T @ np.linalg.solve(K, A), A.T @ np.linalg.solve(K, f) - g
    closed = by_nnls((Q + Q.T) / 2, p) > 0
    lam = np.zeros(len(p))
    lam[closed] = np.linalg.solve(Q[np.ix_(closed, closed)], p[closed])
    gaps = Q @ lam - p
    assert min(lam.min(), gaps.min()) >= -1e-9
    return gaps


def springs(random: np.random.Generator, edges: list[tuple[int, int]], count: int, dofs: int = 1) -> Array:
    """K of nodes on springs, coupled along the edges; all entries are eighths."""
    K = np.diag(random.integers(160, 800, count * dofs) / 8)
    for i, j in edges:
        for a, b in zip(range(i * dofs, (i + 1) * dofs), range(j * dofs, (j + 1) * dofs), strict=True):
            K[np.ix_([a, b], [a, b])] += random.integers(200, 1600) / 8 * np.array([[1, -1], [-1, 1]])
    for a in range(0, count * dofs if dofs > 1 else 0, dofs):
        K[a, a + dofs - 1] = K[a + dofs - 1, a] = random.integers(8, 60) / 8
    return K


def chains(draw: Draw, folder: Path) -> Task:
    """Two chains of springs as K, A, f, g, imported and solved."""
    random, n = draw.random, int(draw.random.integers(3, 6))
    K = sla.block_diag(*(springs(random, [(i, i + 1) for i in range(n - 1)], n) for _ in "ab"))
    if draw.one("stiff", "|spring"):
        K[0, 0] = 1e12
    f, g = random.integers(-400, 400, 2 * n) / 8, random.integers(0, 400, n) / 1000
    data, form = {"K": K, "A": np.vstack([np.eye(n), -np.eye(n)]), "f": f, "g": g}, draw.pick(FORMATS)
    draw.names.append(form)
    damaged, files = draw.pick("KKAfg"), [str(folder / f"own.{form}")]
    if form in ("mtx", "abaqus"):
        files = []
        for name, M in data.items():
            one = draw if name == damaged else Draw(random)
            text = abaqus(one, M, None) if form + name == "abaqusK" else matrix_market(one, M, name == "K")
            content, suffix = encoded(one, text, gz=True)
            files.append(str(folder / f"{name}.mtx{suffix}"))
            Path(files[-1]).write_bytes(content)
    elif form == "pch":
        labels = np.column_stack([np.arange(1, 2 * n + 1), np.zeros(2 * n, dtype=int)])
        text = dmig(draw, {name.upper(): M for name, M in data.items()}, labels)
        Path(files[0]).write_bytes(encoded(draw, text)[0])
    else:
        {"op4": op4, "npz": npz}[form](draw, data, Path(files[0]))

    def read() -> tuple[Array, list[str]]:
        said = io.StringIO()
        import_matrices(files, folder / "out.npz", reporter=onto(said))
        return solve(load_scene(folder / "out.npz")).gap, said.getvalue().splitlines()

    return gaps_of(**data), read


def marked(draw: Draw, gaps: list[Any]) -> None:
    """Replace one of the gaps by what some program writes where there is none."""
    k = int(draw.random.integers(len(gaps)))
    if kind := draw.one("mark", "", "word", "number"):
        gaps[k] = draw.pick(WORDS if kind == "word" else MARKS)
        draw.clues += [f"{gaps[k]:g}" if kind == "number" else "line"]


FORMATS = ("npz", "mtx", "abaqus", "pch", "op4")


class Joint:
    """Two parts of nx × ny nodes, on springs, that face each other; fasteners between them; a scan."""

    def __init__(self, draw: Draw) -> None:
        random = self.random = draw.random
        self.size = random.integers(2, 5, 2)
        self.step, self.origin = draw.pick((20.0, 50.0, 12.5)), np.array(draw.pick(ORIGINS))
        self.place = np.stack(np.meshgrid(*map(np.arange, self.size)), axis=-1).reshape(-1, 2)
        self.xy, self.count = self.place * self.step + self.origin, len(self.place)
        self.dofs = draw.pick(((3,), (3,), (3,), (1, 3), (2, 3), (1, 2, 3)))
        pairs = [(i, j) for i in range(self.count) for j in range(i)]
        edges = [(i, j) for i, j in pairs if abs(self.place[i] - self.place[j]).sum() == 1]
        self.K = {name: springs(random, edges, self.count, len(self.dofs)) for name in "ab"}
        self.points = np.unique(random.integers(0, 4 * self.size - 3, (3, 2)), axis=0) / 4
        self.preload = float(random.integers(20, 120))
        self.gap, self.scan = self.measured(draw.pick(("nodes", "plane", "grid")))

    def measured(self, kind: str) -> tuple[Array, dict[str, Any]]:
        """At the nodes, and a scan of: any gaps there; a plane, at any points; a grid, bilinear between."""
        at, gap, values = self.place, *(self.random.integers(0, 500, self.count) / 1000 for _ in "gv")
        if kind == "plane":
            far = np.array([(-1, -1), (self.size[0], -1), (-1, self.size[1]), tuple(self.size)])
            inside = self.random.integers(0, 4 * self.size - 3, (8, 2)) / 4
            at = np.unique(np.concatenate([far, inside]), axis=0)
            a, b, c = self.random.integers(20, 60) / 100, *(self.random.integers(-3, 4, 2) / 25)
            gap, values = (np.round(a + b * x + c * y, 2) for x, y in (self.place.T, at.T))
        elif kind == "grid":
            at, lines = 1.5 * self.place - 0.5, [1.5 * np.arange(n) - 0.5 for n in self.size]
            gap = RegularGridInterpolator(lines, values.reshape(self.size[::-1]).T)(self.place)
        else:
            values = gap
        x, y = (at * self.step + self.origin).T
        return gap, {"x": x.tolist(), "y": y.tolist(), "gap": values.tolist()}

    def right(self) -> Array:
        away = abs(self.points[:, None] - self.place)
        W = np.zeros((self.count, len(self.dofs)))
        W[:, self.dofs.index(3)] = np.clip(1 - away, 0, None).prod(axis=2).sum(axis=0) * self.preload
        E = np.eye(W.size)[:, self.dofs.index(3) :: len(self.dofs)]
        f = np.concatenate([W.ravel(), -W.ravel()])
        return gaps_of(sla.block_diag(self.K["a"], self.K["b"]), np.vstack([E, -E]), f, self.gap)

    def part(self, folder: Path, name: str, draw: Draw, of_nodes: Draw) -> str:
        """Write the files of a part; the table that names them."""
        d, K, form = len(self.dofs), self.K[name], draw.one("format", "|".join(FORMATS))
        ids, how = np.arange(1, self.count + 1), of_nodes.one("ids", "1, 2, …|any|descending")
        if how != "1, 2, …":
            ids = 1 + 7 * (self.random.permutation(self.count) if how == "any" else ids[::-1])
        labels = np.column_stack([np.repeat(ids, d), np.tile(self.dofs, self.count)])
        labelled, rows = form in ("abaqus", "pch"), draw.one("rows", "table|ids|directions")
        by = {"table": np.zeros(len(K)), "ids": labels[:, 0], "directions": labels[:, 1]}[rows]
        order, key = np.argsort(by, kind="stable"), ""
        if not labelled and (rows != "table" or how != "1, 2, …" or d > 1):
            key = draw.one("key", f'rows = "{rows}"\n', "no key")
        K, labels, file = K[np.ix_(order, order)], labels[order], folder / f"{name}.{form}"
        if form in ("npz", "op4"):
            {"op4": op4, "npz": npz}[form](draw, {"K": K}, file)
        else:
            if form == "pch" and d == 1 and draw.one("labels", "grid|scalar") == "scalar":
                labels[:, 1] = 0
            texts = {"abaqus": lambda: abaqus(draw, K, labels), "mtx": lambda: matrix_market(draw, K, True)}
            text = texts.get(form, lambda: dmig(draw, {draw.pick(["K", "KAAX"]): K}, labels))()
            content, suffix = encoded(draw, text, gz=True)
            file = file.with_name(f"{name}.{form.replace('abaqus', 'mtx')}{suffix}")
            file.write_bytes(content)
        (x, y), z = self.xy.T.tolist(), [0.0] * self.count
        nodes = {"id": ids.tolist(), "x": x, "y": y, "z": z}
        self.save(folder / f"{name}.csv", of_nodes, nodes, "open" * labelled)
        files = f'superelement = "{file.name}"\nnodes = "{name}.csv"\n{key.replace("no key", "")}'
        return f'[[joint.part]]\nname = "{name}"\ndofs = {list(self.dofs)}\n{files}'

    def save(self, path: Path, draw: Draw, columns: Any, twice: str) -> None:
        path.write_bytes(encoded(draw, table(draw, columns, set(columns) - {"id"}, twice))[0])

    def save_scan(self, path: Path, draw: Draw) -> None:
        """The scan, with something in it that no scanner measures."""
        k = int(self.random.integers(len(self.scan["gap"])))
        match draw.one("points", "", "word", "zeros" if max(self.origin) > 500 else "", "near"):
            case "zeros":
                for column in self.scan.values():
                    column.insert(k, 0.0)
                draw.clues += ["0, 0", "line"]
            case "near":
                for column, more in zip(self.scan.values(), (1e-4, 0.0, 0.3), strict=True):
                    column.append(column[k] + more)
            case "word":
                self.scan["x"][k] = draw.pick(WORDS)
            case _:
                marked(draw, self.scan["gap"])
        self.save(path, draw, self.scan, "open")


def joint(draw: Draw, folder: Path) -> Task:
    """Two superelements, fasteners and a scan; one of the files is spelled in an unusual way."""
    made, usual = Joint(draw), Draw(draw.random)
    name = draw.pick(("K", "K", "nodes a", "nodes b", "scan", "scan", "points", "scene"))
    draw.names.append(name)
    of = {name: draw} | ({"nodes a": draw} if name == "K" else {})
    text = made.part(folder, "a", of.get("K", usual), of.get("nodes a", usual))
    text += made.part(folder, "b", usual, of.get("nodes b", usual))
    x, y = (made.points * made.step + made.origin).T.tolist()
    made.save(folder / "points.csv", of.get("points", usual), {"x": x, "y": y}, "marked")
    made.save_scan(folder / "scan.csv", of.get("scan", usual))
    text += f'[[effect]]\nkind = "fasteners"\npreload = {made.preload}\nfile = "points.csv"\n'
    text += '[[effect]]\nkind = "measured_gap"\nfile = "scan.csv"\n'
    (folder / "scene.toml").write_bytes(encoded(of.get("scene", usual), text, "#")[0])
    whole = draw.random.random() < 0.2

    def read() -> tuple[Array, list[str]]:
        scene = load_scene(folder / "scene.toml")
        assembly, load = prepared(scene).assembly, load_case(scene)
        if whole:
            gap = solve(scene).gap
        else:
            gap = gaps_of(sla.block_diag(*assembly.K.matrices), assembly.A.toarray(), load.f, load.g)
        return gap[np.lexsort(np.round(assembly.contact_nodes, 3).T)], [*scene.unusual, *assembly.notes]

    return made.right(), read


def around(draw: Draw, folder: Path) -> Task:
    """Random gaps that pass through a scan at the nodes, but for a noise of some 1e-4 mm."""
    made, usual = Joint(draw), Draw(draw.random)
    made.gap, made.scan = made.measured("nodes")
    text = "".join(made.part(folder, name, usual, usual) for name in "ab")
    (folder / "scene.toml").write_text(text)
    made.save_scan(folder / "scan.csv", draw)

    def read() -> tuple[Array, list[str]]:
        scene = load_scene(folder / "scene.toml")
        law = {"sd": 0.1, "correlation_length": 1.5 * made.step}
        cases = random_gaps(scene, 1, 0, **law, around=folder / "scan.csv")
        gap = cases.load(0).g[np.lexsort(np.round(prepared(scene).assembly.contact_nodes, 3).T)]
        return np.where(abs(gap - made.gap) < 2e-3, made.gap, gap), list(cases.notes)

    return made.gap, read


def listed(draw: Draw, folder: Path) -> Task:
    """A table of gaps, a case a row."""
    m = int(draw.random.integers(3, 8))
    gaps = draw.random.integers(0, 500, (int(draw.random.integers(2, 5)), m)) / 1000
    heads = draw.one("heads", "|0|1|gap", "101")
    names = [f"gap {k}" if heads == "gap" else str(k + int(heads or 0)) for k in range(m)]
    columns = dict(zip(names, gaps.T.tolist(), strict=True))
    marked(draw, columns[draw.pick(names)])
    path = folder / "gaps.csv"
    path.write_bytes(encoded(draw, table(draw, columns, heads=bool(heads)))[0])

    def read() -> tuple[Array, list[str]]:
        cases = measured_gaps(own_matrices(np.eye(m), np.eye(m), np.zeros(m), np.zeros(m)), path)
        return np.array([cases.load(k).g for k in range(cases.count)]), list(cases.notes)

    return gaps, read


def judged(draw: Draw, folder: Path) -> Task:
    """An answer as a column of a table."""
    x = draw.random.integers(-3000, 3000, int(draw.random.integers(3, 8))) / 1000
    (folder / "x.csv").write_bytes(encoded(draw, table(draw, {"x": x.tolist()}))[0])
    return x, lambda: (read_answer(folder / "x.csv")["x"], [])


TARGETS = (chains, chains, joint, joint, joint, around, listed, judged)


def tried(log: Log, draw: Draw, folder: Path) -> None:
    """One draw. Raises Fault."""
    right, read = draw.pick(TARGETS)(draw, folder)
    log.where += f": {', '.join(draw.names)}"
    try:
        answer, said = read()
    except InputError as error:
        text, outcome = str(error), "refused"
        named = any(path.name in text for path in folder.iterdir())
        if not named or len(text.splitlines()) > MOST_LINES or PYTHON.search(text):
            raise Fault("words", text) from error
    else:
        text = " / ".join(said)
        same = np.shape(answer) == np.shape(right) and abs(answer - right).max() <= CLOSE
        outcome = "right" if same else "said" if any(clue in text for clue in draw.clues) else "another"
        text = f"{np.round(answer, 4)} for {np.round(right, 4)}; {text}"
    if outcome not in OUTCOMES[draw.kind]:
        raise Fault("wrong", f"{outcome}: {text}")
    log.seen[outcome] += 1


@pytest.mark.parametrize("part", range(PARTS))
def test_spellings_are_right_or_refused(part: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log, count = Log(), draws(60, 20_000)
    monkeypatch.setenv("RIVETBENCH_CACHE", str(tmp_path / "cache"))
    for index in range(part, count, PARTS):
        (tmp_path / "work").mkdir()
        with log.contained(f"draw {index}", TIME_LIMIT_S):
            random = np.random.default_rng([SEED, index])
            tried(log, Draw(random, random.choice(PLAIN)), tmp_path / "work")
        for folder in ("work", "cache"):
            shutil.rmtree(tmp_path / folder, ignore_errors=True)
    log.nothing_found()
    assert log.seen["right"] > 0.3 * count / PARTS  # else little was read
    assert log.seen["refused"] > 0.1 * count / PARTS
