"""A commented scene to start from."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from problems.errors import InputError

STARTER = Path(__file__).with_name("starter.toml")


def write(path: Path, console: Console) -> None:
    """Write it to `path`. Raises InputError if that exists or is no .toml."""
    if path.suffix != ".toml":
        raise InputError.one("FILE", "path", str(path), "must end in .toml, which makes it a scene")
    if path.exists() or path.is_symlink():
        raise InputError.one("FILE", "path", str(path), "exists: name another")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(STARTER.read_text("utf-8").replace("FILE", str(path)), "utf-8")
    console.print(f"{path}: edit it, then `python -m harness solve {path} --out results/{path.stem}`.")
