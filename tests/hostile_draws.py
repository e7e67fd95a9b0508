"""Mutations of files: what disks, other programs and hostile users do to them.

A mutation takes a path and changes what is there. `mutate` chooses one that fits the file.
"""

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

Random = np.random.Generator

NUMBERS = (
    *("1e308", "-1e308", "nan", "inf", "-inf", "5e-324", "1e-310", "0", "-0.0", "-1", "1e999", "9" * 5000),
    *("9223372036854775808", "18446744073709551617", "1.5", "0x10", "1_000", "1e15", "1e16", "3", "0.25", ""),
)
TEXTS = (
    *("[/b]", "[link=x]y", "<script>alert(1)</script>", "$x_{$", "\u202eabc", "=cmd|x", "../../x"),
    *("a" * 3000, "|", "`c`", "\n# h", "![i](http://e)", "\x1b[31m", "", " ", "\u0000", "é" * 40, "nan"),
    "[" * 5000,
)
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 10**400, 2**63, 1e308, -1e-310, 1.5, [], {}, [1, "a"], {"a": [{}]}),
    *(float("nan"), float("inf"), *TEXTS),
)
ARRAYS: tuple[Callable[[Any], Any], ...] = (
    lambda a: a * np.nan,
    lambda a: a * 1e308,
    lambda a: a / abs(a).max(initial=1e-300) * 1.7e308,
    lambda a: a * 1e-310,
    lambda a: a * 0,
    lambda a: -a,
    lambda a: a[..., :-1],
    lambda a: a[None],
    lambda a: a.astype(str),
    lambda a: a.astype(complex),
    lambda a: a.astype(np.int8),
    lambda a: a.astype(np.float32),
    lambda a: a.astype(np.longdouble) * (1 + np.longdouble(2) ** -60),
    lambda a: np.asfortranarray(a),
    lambda a: np.zeros(0),
    lambda a: a.astype(object),
    lambda a: a * 2.0**40,
    lambda a: (a * 2.0**55).astype(np.int64) if abs(a).max(initial=0) < 200 else a,
)


def bytes_flipped(random: Random, path: Path) -> None:
    content = bytearray(path.read_bytes())
    for _ in range(int(random.integers(1, 4))):
        if content:
            content[random.integers(len(content))] ^= 1 << random.integers(8)
    path.write_bytes(content)


def truncated(random: Random, path: Path) -> None:
    content = path.read_bytes()
    path.write_bytes(content[: random.integers(len(content) + 1)])


def lengthened(random: Random, path: Path) -> None:
    content = path.read_bytes()
    at = int(random.integers(len(content) + 1))
    path.write_bytes(content[:at] + random.bytes(int(random.integers(1, 60))) + content[at:])


def in_another_encoding(random: Random, path: Path) -> None:
    text = path.read_text(errors="replace")
    encoding = ("utf-16", "utf-32", "utf-8-sig", "cp037", "latin-1")[random.integers(5)]
    path.write_bytes((text + "é").encode(encoding, "replace"))


def special(random: Random, path: Path) -> None:
    """Not a regular file any more."""
    path.unlink()  # and sometimes gone
    kinds = [os.mkfifo, Path.mkdir, lambda path: path.symlink_to("/dev/zero")]
    kinds += [lambda path: path.symlink_to(path.name), Path.touch, lambda path: None]
    kinds[random.integers(6)](path)


ANY = (bytes_flipped, truncated, lengthened, in_another_encoding, special)


def lines_moved(random: Random, path: Path) -> None:
    """A line deleted, twice, or elsewhere."""
    lines = path.read_text(errors="surrogateescape").splitlines(keepends=True)
    if not lines:
        return
    line = lines[random.integers(len(lines))]
    at = int(random.integers(len(lines)))
    if random.random() < 0.5:
        lines.remove(line)
    if random.random() < 0.6:
        lines.insert(at, line)
    path.write_text("".join(lines), errors="surrogateescape")


def _replaced(random: Random, path: Path, pattern: str, words: tuple[str, ...]) -> None:
    text = path.read_text(errors="surrogateescape")
    found = list(re.finditer(pattern, text))
    if found:
        match, word = found[random.integers(len(found))], words[random.integers(len(words))]
        changed = text[: match.start()] + word + text[match.end() :]
        path.write_text(changed, errors="surrogateescape")


def number_swapped(random: Random, path: Path) -> None:
    _replaced(random, path, r"-?\d+(\.\d*)?([eE][-+]?\d+)?", NUMBERS)


def text_swapped(random: Random, path: Path) -> None:
    words = tuple(json.dumps(text)[1:-1] for text in TEXTS)
    _replaced(random, path, r'(?<=")[^"\n]*(?=")', words)


def key_swapped(random: Random, path: Path) -> None:
    _replaced(random, path, r"(?m)^\w+(?= *=)", ("kind", "name", "x", "", "value", "part", "random"))


def type_swapped(random: Random, path: Path) -> None:
    values = ('"a"', "[]", "{}", "true", "1", "2020-01-01", "[[1], [2]]", '{ a = "b" }', "[" * 2000)
    _replaced(random, path, r"(?m)(?<== ).+$", values)


TEXT = (*ANY, lines_moved, number_swapped, number_swapped)
TOML = (*TEXT, text_swapped, key_swapped, type_swapped, type_swapped)


def row_changed(random: Random, path: Path) -> None:
    """A field of a line of JSON, or of a file that is one, with another value, or gone."""
    lines = path.read_text().splitlines()
    whole = path.suffix == ".json"
    at = 0 if whole else int(random.integers(len(lines)))
    row = json.loads("\n".join(lines) if whole else lines[at])
    target = row
    while True:
        key = list(target)[random.integers(len(target))]
        if not (isinstance(target[key], dict) and target[key] and random.random() < 0.7):
            break
        target = target[key]
    if random.random() < 0.2:
        del target[key]
    else:
        target[key] = VALUES[random.integers(len(VALUES))]
    lines[at : None if whole else at + 1] = [json.dumps(row)]
    path.write_text("\n".join(lines) + "\n")


JSON = (*ANY, row_changed, row_changed, row_changed, lines_moved, number_swapped, text_swapped)


def array_changed(random: Random, path: Path) -> None:
    """One array of an .npz with other values, of another kind or shape, under another name, or gone."""
    with np.load(path) as file:
        arrays = dict(file)
    name = list(arrays)[random.integers(len(arrays))]
    array = arrays.pop(name)
    if random.random() < 0.9:
        new = "x" if random.random() < 0.05 else name
        with np.errstate(all="ignore"):
            arrays[new] = ARRAYS[random.integers(len(ARRAYS))](array) if array.ndim else array * np.nan
        if random.random() < 0.3 and array.ndim and array.size and array.dtype.kind == "f":
            arrays[name] = array.copy()
            arrays[name].flat[random.integers(array.size)] = float(NUMBERS[random.integers(7)])
    np.savez(path, **arrays)


NPZ = (*ANY, array_changed, array_changed, array_changed)
OF_SUFFIX = {".toml": TOML, ".json": JSON, ".jsonl": JSON, ".npz": NPZ, ".f4": ANY, ".npy": ANY, ".op4": ANY}


def mutate(random: Random, path: Path) -> str:
    """Change a file; the name of what was done."""
    chosen = OF_SUFFIX.get(path.suffix, TEXT)
    mutation = chosen[random.integers(len(chosen))]
    path.chmod(0o644)
    mutation(random, path)
    return mutation.__name__
