"""A scene checked, written for other programs, and read from their files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from harness.planning.form_choice import Size, size_of
from harness.scene import export as files_of
from harness.scene import validate as checks
from harness.terminal.console import console_of
from problems.forms import Form
from problems.reporter import SILENT, Reporter
from problems.scene_files import read_scene


def validate(scene: str | Path, *, reporter: Reporter = SILENT) -> Size | None:
    """Check a scene without solving it.

    Parameters
    ----------
    scene : str or Path
        Name of a scene, or the path of its file.
    reporter : Reporter, optional
        With the console of a ConsoleReporter, what would be built is shown; silent by default.

    Returns
    -------
    Size or None
        n unknowns, m contacts, and the memory of either form, MiB; None for small matrices.

    Raises
    ------
    InputError
        With all faults of the scene.

    Examples
    --------
    >>> from rivetbench import validate
    >>> size = validate("gallery/three-part-stack")
    >>> size.n, size.m
    (1107, 738)
    """
    checks.validate(str(scene), console_of(reporter))
    return size_of(read_scene(str(scene)))


def export(
    scene: str | Path,
    out: str | Path,
    *,
    format: str | None = None,
    form: Form | None = None,
    with_reference: bool = False,
    reference_limit_s: float | None = None,
    reporter: Reporter = SILENT,
) -> Path:
    """Write K, A, f, g of a scene in a file format, or its quadratic program in a form.

    Parameters
    ----------
    scene : str or Path
        Name of a scene, or the path of its file.
    out : str or Path
        A file, or a folder for a format of several files.
    format : str, optional
        Format of K, A, f, g: npz, mtx, op4, …; none if `form` is given.
    form : str, optional
        "primal", "dual" or "sparse": P, q, G, h (or lb) of min ½zᵀPz + qᵀz, Gz ≤ h, in N and mm.
    with_reference : bool, optional
        With a form: also x*, λ*, their error bound and the limit.
    reference_limit_s : float, optional
        Limit on the search for the reference, s.
    reporter : Reporter, optional
        With the console of a ConsoleReporter, what was written is shown; silent by default.

    Returns
    -------
    Path
        What was written.

    Raises
    ------
    InputError
        If the scene or a choice is wrong.

    Examples
    --------
    >>> from rivetbench import export
    >>> export("gallery/three-part-stack", "stack.npz", format="npz").exists()
    True
    """
    console = console_of(reporter)
    files_of.export(str(scene), format, Path(out), console, form, with_reference, reference_limit_s)
    return Path(out)


def import_matrices(files: Sequence[str], out: str | Path, *, reporter: Reporter = SILENT) -> Path:
    """Read K, A, f, g from other programs' files, check them, and write them as one .npz, which is a scene.

    Parameters
    ----------
    files : sequence of str
        PATH, NAME=PATH for a file of one matrix, NAME=PATH:MATRIX for one of several. K is in N/mm, f in N,
        g in mm.
    out : str or Path
        The .npz to write.
    reporter : Reporter, optional
        With the console of a ConsoleReporter, sizes and digits are shown; silent by default.

    Returns
    -------
    Path
        The .npz, which `load_scene` reads.

    Raises
    ------
    InputError
        If a file is wrong, or K is not symmetric and positive definite.

    Examples
    --------
    >>> from rivetbench import export, import_matrices
    >>> op4 = export("gallery/three-part-stack", "stack.op4", format="op4")
    >>> import_matrices([str(op4)], "mine.npz").name
    'mine.npz'
    """
    files_of.import_(list(files), Path(out), console_of(reporter))
    return Path(out)
