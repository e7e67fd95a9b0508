"""Any public function, called from eight threads at once, gives the bits that one thread gives."""

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import count, islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import threadpoolctl
from sample_size import draws
from small_problems import make_load, own_arrays

import harness
from harness import LoadCase
from problems.effects.fasteners import Fasteners
from problems.forms.prepared import Prepared
from problems.model.scene import Scene
from solvers.methods.gi import GoldfarbIdnani

THREADS = 8
NAMES = ("gallery/shimmed-strip", "gallery/heavy-sheet-on-tool")


def problem(k: int) -> tuple[Prepared, LoadCase, tuple[Any, ...]]:
    return own_arrays(k, 4 + k % 3)


OWN = [harness.own_matrices(*problem(k)[2]) for k in range(THREADS)]
JOINT = harness.load_scene("examples/small-joint.toml")  # one object for all threads
STACK = harness.load_scene("gallery/three-part-stack")
FASTENERS = Fasteners(kind="fasteners", preload=300.0, points=((100.0, 60.0), (250.0, 40.0)))
FASTENED = replace(STACK, effects=(*STACK.effects, FASTENERS))  # type: ignore[attr-defined, call-arg]
LAW = {"mean": 0.1, "sd": 0.05, "correlation_length": 300.0}


def series(scene: Scene, cases: Any) -> list[Any]:
    return [result.gap for result in harness.solve_series(scene, cases)]


def explored(k: int) -> list[Any]:
    explorer = harness.Explorer(FASTENED, "dual")
    answer = explorer.answer(replace(explorer.settings, preload=300.0 + 100.0 * k))
    return [answer.lam, answer.gap, explorer.proven(answer).gap]


def cases(k: int) -> list[LoadCase]:
    return [make_load(10 * k + i, problem(k)[0])[0] for i in range(3)]


#: By name how many calls differ, and the k-th of them.
CALLS: dict[str, tuple[int, Callable[[int], Any]]] = {
    "load_scene": (2, lambda k: harness.load_scene(NAMES[k]).key),
    "own_matrices": (8, lambda k: harness.own_matrices(*problem(k)[2]).key),
    "solve": (8, lambda k: [(s := harness.solve(harness.own_matrices(*problem(k)[2]))).x, s.lam, s.gap]),
    "solve one object": (2, lambda k: harness.solve(OWN[k], (None, "newton")[k]).x),
    "solve a joint": (2, lambda k: harness.solve(JOINT, form=("dual", "sparse")[k]).x),
    "judge": (8, lambda k: harness.judge(OWN[k], np.ones(10 + 2 * (k % 3))).displacement_error_mm),
    "solve_dual": (
        8,
        lambda k: harness.solve_dual(problem(k)[0].Q, problem(k)[1].p, ("newton", "gi")[k % 2]).lam,
    ),
    "solve_series": (8, lambda k: series(OWN[k], cases(k))),
    "solve_series of random gaps": (8, lambda k: series(JOINT, harness.random_gaps(JOINT, 3, k, **LAW))),
    "random_gaps": (8, lambda k: harness.random_gaps(JOINT, 2, k, **LAW).load(1).g),
    "check_solver": (1, lambda _: list(map(str, harness.check_solver(GoldfarbIdnani, ("dual",))))),
    "Explorer": (8, explored),
}


def bits(value: Any) -> Any:
    return [bits(each) for each in value] if isinstance(value, list) else np.asarray(value).tobytes()


def endless(data: Prepared, f: np.ndarray, g: np.ndarray) -> Iterator[LoadCase]:
    """Cases without end, all in the same two arrays."""
    for k in count():
        case = make_load(k, data)[0]
        f[:], g[:] = case.f, case.g
        yield LoadCase(f, g)


def test_a_generator_may_have_no_end_and_reuse_its_arrays() -> None:
    data, load, own = problem(0)
    found = harness.solve_series(harness.own_matrices(*own), endless(data, load.f.copy(), load.g.copy()))
    listed = series(OWN[0], [make_load(k, data)[0] for k in range(70)])
    some = list(islice(found, 70))
    assert [result.row["case"] for result in some] == list(range(70))
    for result, gap in zip(some, listed, strict=True):
        np.testing.assert_array_equal(result.gap, gap)


def test_what_the_caller_owns_is_the_callers() -> None:
    """Own matrices may be changed afterwards."""
    K, A, f, g = np.diag([2.0, 4.0]), np.eye(2), np.array([1.0, 1.0]), np.array([0.1, 1.0])
    scene = harness.own_matrices(K, A, f, g)
    for array in (K, A, f, g):
        array[:] = 7.0
    x = harness.solve(scene).x
    np.testing.assert_allclose(x, [0.1, 0.25])


@pytest.mark.parametrize("name", CALLS)
def test_threads_get_the_bits_of_one(name: str) -> None:
    (different, call), rounds = CALLS[name], -(-draws(8, 1000) // THREADS)
    alone = [bits(call(k)) for k in range(different)]
    barrier = threading.Barrier(THREADS)

    def hammer(k: int) -> int:
        barrier.wait()
        return sum(bits(call(j % different)) != alone[j % different] for j in range(k, k + rounds))

    with ThreadPoolExecutor(THREADS) as pool:
        assert list(pool.map(hammer, range(THREADS))) == [0] * THREADS


def test_a_series_leaves_the_threads_of_linear_algebra(tmp_path: Path) -> None:
    before = threadpoolctl.threadpool_info()
    harness.run_series(
        "examples/small-joint.toml", tmp_path / "out", options=harness.SeriesOptions(threads=3)
    )
    assert threadpoolctl.threadpool_info() == before
