"""The commands for a scene: init, validate, solve."""

import shlex
from functools import partial
from pathlib import Path
from string import Template
from typing import Annotated

import tomlkit
import typer

from . import options
from .options import NOTHING_WRITTEN, error_reporting, option

STARTER = Path(__file__).with_name("starter.toml")
STARTER_OF_PARTS = STARTER.with_name("starter-superelements.toml")
DOFS = """dofs = [3]                              # the rows of K at each node: 1, 2, 3 displacements,
                                        # 4, 5, 6 rotations; DMIG and Abaqus' text say them themselves
# rows = "table"                        # the order of the rows, where dofs are several or ids do not ascend

"""


def solve(
    scene: options.SceneName,
    other: Annotated[
        str | None, typer.Argument(metavar="[OTHER]", help="A second scene on the same junction.")
    ] = None,
    *,
    out: Annotated[Path, option("DIR", "Output directory.")],
    solver: Annotated[
        str | None, option("NAME", "A solver by name.  [default: in-house methods, until one is proven]")
    ] = None,
    tolerance: Annotated[float, option("TOL", "Tolerance passed to a named solver.")] = 1e-9,
    form: Annotated[
        options.FormName | None,
        option("FORM", "primal, dual, or sparse (without condensation).  [default: by size]"),
    ] = None,
    reference_limit: options.ReferenceLimit = None,
    allow_gap: options.AllowGap = None,
    allow_stress: options.AllowStress = None,
    refine: Annotated[
        bool, typer.Option("--refine", help="Estimate the mesh error from a finer mesh, too.")
    ] = False,
) -> None:
    """Solve one scene: gaps, displacements and contact forces, as pictures and files.

    Without --solver the answer comes with a proven bound on its error; with --solver it is judged against
    that answer. If the parts do not meet, this is a linear solve. The error of the finite-element mesh is
    estimated from a coarser one.

    The stages of a scene are solved in turn, and listed in a table; --allow-gap judges the last one.

    Two scenes on one junction, such as two plans of fasteners, are solved into DIR/first and DIR/second and
    compared: gaps side by side, a map of the difference, the force in each fastener. --allow-gap then judges
    the second. If their meshes differ, gaps are compared at the contacts of the coarser one, and the
    command says whether the mesh changes the verdict.

    \b
    Examples:
      python -m harness solve gallery/heavy-sheet-on-tool --out results/sheet
      python -m harness solve my-scene.toml --solver piqp --out results/my-scene
      python -m harness solve my-scene.toml --allow-gap 0.05 --out results/my-scene
      python -m harness solve before.toml after.toml --out results/both

    \b
    Exit codes: 0 solved, 1 no answer or not within 1e-7 mm, 2 wrong usage or bad input,
                3 what is proven does not decide about --allow-gap or --allow-stress,
                4 a gap is larger than --allow-gap, or a stress than --allow-stress,
                5 the two scenes differ in their junction, or in which parts are in contact.
    """
    with error_reporting(*NOTHING_WRITTEN) as console:
        from harness.scene.solve import solve_into
        from harness.scene.two_scenes import solve_both

        solved = partial(
            solve_into,
            solver=solver,
            tolerance=tolerance,
            console=console,
            reference_limit_s=reference_limit,
            form=form,
            allow_gap_mm=allow_gap,
            refine=refine,
            allow_stress=allow_stress,
        )
        if other is None:
            raise typer.Exit(solved(scene, out=out))
        raise typer.Exit(solve_both((scene, other), out, solved, console))


def validate(scene: options.SceneName) -> None:
    """Check a scene without solving it; show what would be built, its size and memory.

    \b
    Examples:
      python -m harness validate my-scene.toml

    \b
    Exit codes: 0 valid, 2 bad input.
    """
    with error_reporting(*NOTHING_WRITTEN) as console:
        from harness.scene.validate import validate as validate_scene
        from harness.terminal.console import ConsoleReporter

        validate_scene(scene, reporter=ConsoleReporter(console))


def init(
    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[FILE]", help="The scene to write.  [default: joint.toml]"),
    ] = None,
    superelements: Annotated[
        bool,
        typer.Option("--superelements", help="Write a scene of superelements; the other FILEs hold their K."),
    ] = False,
) -> None:
    """Write a commented scene to start from: a joint of two sheets, a gap, fasteners; or of your own parts.

    \b
    Examples:
      python -m harness init joint.toml && python -m harness solve joint.toml --out results/joint
      python -m harness init --superelements wing.op4 frame.op4 joint.toml

    \b
    Exit codes: 0 written, 2 the file exists, or is no .toml.
    """
    with error_reporting(*NOTHING_WRITTEN) as console:
        from harness.results.atomic_output import refuse_unwritable
        from problems.errors import InputError

        given = files or []
        scenes = [each for each in given if each.suffix == ".toml"] if superelements else given
        parts = [each for each in given if each not in scenes]
        file = scenes[0] if scenes else Path("joint.toml")
        if file.suffix != ".toml" or len(scenes) > 1:
            allowed = "one scene, which ends in .toml; superelements with --superelements"
            raise InputError.one("FILE", "path", ", ".join(map(str, scenes)), allowed)
        if superelements and len(parts) < 1:
            raise InputError.one("--superelements", "FILE", None, "the file of K of each part")
        if file.exists() or file.is_symlink():
            raise InputError.one("FILE", "path", str(file), "exists: name another")
        refuse_unwritable(file, (), "FILE")
        path, folder = shlex.quote(str(file)), shlex.quote(f"results/{file.stem}")
        if not path.isprintable():
            raise InputError.one("FILE", "path", str(file), "a name on one line")
        starter = STARTER_OF_PARTS if superelements else STARTER
        text = Template(starter.read_text("utf-8")).substitute(FILE=path, **_of_parts(parts, file))
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, "utf-8")
        console.print(f"{file}: edit it, then `python -m harness solve {path} --out {folder}`.")


def _of_parts(parts: list[Path], scene: Path) -> dict[str, str]:
    """What the scene says of parts whose K are in these files, their nodes beside them."""
    from harness.scene.scene_file import relative

    tables, names = "", [part.stem for part in parts]
    if len(set(names)) < len(names):  # such as wing/K.mtx and frame/K.mtx
        names = [part.absolute().parent.name for part in parts]
    for part, name in zip(parts, names, strict=True):
        there = relative(part, scene.parent)
        nodes = Path(there).with_suffix(".csv").as_posix()
        files = f"superelement = {_quoted(there)}\nnodes = {_quoted(nodes)}\n"
        tables += f"[[joint.part]]\nname = {_quoted(name)}\n{files}{DOFS}"
    return {"TITLE": _quoted(" on ".join(names)), "PARTS": tables.rstrip()}


def _quoted(text: str) -> str:
    return tomlkit.string(text).as_string()
