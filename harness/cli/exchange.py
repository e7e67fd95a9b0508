"""The commands for exchange with other programs: export, import, judge."""

from pathlib import Path
from typing import Annotated

import typer

from .options import NOTHING_WRITTEN, FormName, ReferenceLimit, SceneName, error_reporting, option


def export(
    scene: SceneName,
    out: Annotated[Path, option("PATH", "A file, or a folder for a format of several files.")],
    format: Annotated[str | None, option("FORMAT", "Of K, A, f, g: a name from `list formats`.")] = None,
    form: Annotated[
        FormName | None, option("FORM", "The quadratic program in this form: primal, dual or sparse.")
    ] = None,
    with_reference: Annotated[
        bool, typer.Option("--with-reference", help="With --form: x*, λ*, their error bound, the limit.")
    ] = False,
    reference_limit: ReferenceLimit = None,
) -> None:
    """Write a scene for another program: K, A, f, g in a file format, or the program of a form.

    With --form: P, q, G, h (or the lower bounds lb) of min ½zᵀPz + qᵀz, Gz ≤ h, as .npz, .mps, .qps or, with
    no suffix, a folder of Matrix Market files. Readers in Python, C++, Julia and Matlab: docs/exchange.md.
    For a suite: PATH.parquet, a test set of qpbenchmark.

    \b
    Examples:
      python -m harness export 4386/0107 --format npz --out joint.npz
      python -m harness export gallery/three-part-stack --format op4 --out stack.op4
      python -m harness export scaling/1170 --form dual --with-reference --out problem
      python -m harness export 4386/0107 --form primal --with-reference --out problem.npz
      python -m harness export 4386/0107 --form dual --out problem.mps
      python -m harness export gate --form dual --out gate.parquet

    \b
    Exit codes: 0 written, 2 wrong usage or bad input.
    """
    with error_reporting(*NOTHING_WRITTEN) as console:
        from harness.scene.export import export as export_scene
        from harness.terminal.console import ConsoleReporter

        export_scene(
            scene,
            out,
            format=format,
            form=form,
            with_reference=with_reference,
            reference_limit_s=reference_limit,
            reporter=ConsoleReporter(console),
        )


def import_(
    files: Annotated[
        list[str],
        typer.Argument(
            metavar="[NAME=]FILE[:MATRIX]...", help="K, A, f, g: .mtx, .mtx.gz, .npz, .op4, .pch or .bdf."
        ),
    ],
    out: Annotated[Path, option("FILE.npz", "Output file.")],
) -> None:
    """Read K, A, f, g from other programs' files, check them, and write one .npz for `run` and `solve`.

    Matrix Market and Abaqus matrix text (.mtx) hold one matrix, named by the file or by NAME=; .npz,
    Nastran .op4 and DMIG (.pch, .bdf) name theirs; NAME=FILE:MATRIX takes one of several. K is checked for
    symmetry, definiteness and apparent precision. What is understood and refused: docs/exchange.md.

    \b
    Examples:
      python -m harness import K.mtx A.mtx f.mtx g.mtx --out mine.npz
      python -m harness import K=job_STIF2.mtx A.mtx f.mtx g.mtx --out mine.npz
      python -m harness import joint.op4 --out mine.npz
      python -m harness import K=job.op4:KAA A.mtx f.mtx g.mtx --out mine.npz

    \b
    Exit codes: 0 read and written, 2 wrong usage or bad input.
    """
    with error_reporting(*NOTHING_WRITTEN) as console:
        from harness.scene.import_files import import_matrices
        from harness.terminal.console import ConsoleReporter

        import_matrices(files, out, reporter=ConsoleReporter(console))


def judge(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="x or λ: .npz or .csv.")],
    scene: SceneName,
    form: Annotated[
        FormName | None, option("FORM", "The form it was computed in: in sparse, x has all unknowns.")
    ] = None,
    limit: Annotated[float, option("MM", "Limit on the error.")] = 1e-7,
    reference_limit: ReferenceLimit = None,
) -> None:
    """Judge an answer that was computed elsewhere: its error, against the certified reference of the scene.

    An .npz has arrays x or lam, a .csv such columns, or displacement_mm or force_N, as the tables of `solve`;
    x is in mm, λ in N. Where there is only λ, x is recovered from it.

    \b
    Examples:
      python -m harness judge x.npz 4386/0107
      python -m harness judge lambda.csv scaling/1170
      python -m harness judge results/sheet/nodes.csv gallery/heavy-sheet-on-tool

    \b
    Exit codes: 0 within the limit, 1 outside, 2 wrong usage or bad input (NaN, not numbers),
                3 the reference is not proven well enough, 5 an x or λ of another problem's length.
    """
    with error_reporting(*NOTHING_WRITTEN) as console:
        from harness.scene.judge_file import judge_file

        raise typer.Exit(judge_file(file, scene, form, limit, console, reference_limit))
