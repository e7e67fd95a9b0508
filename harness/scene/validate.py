"""Checks a scene without solving it: its parts and effects, its size and memory, the digits of a given K."""

import numpy as np
import scipy.sparse as sp
from rich.console import Console
from rich.table import Table
from rich.text import Text

from harness.planning.form_choice import Size, chosen_form, size_of
from harness.results.provenance import physical_memory_mib
from harness.terminal.console import console_of
from harness.terminal.docstrings import docstring
from harness.verification.judge import LIMIT_MM
from harness.verification.reference_problem import ReferenceProblem
from harness.verification.rounded_stiffness import estimated_displacements, expected_error
from problems.build import prepared, same_stiffness
from problems.errors import InputError
from problems.forms import FORMS
from problems.forms.assembly import Assembly
from problems.input.matrix_files import DOUBLE, apparent_digits
from problems.model.effect import Effect
from problems.model.interface import AnyJoint
from problems.model.joint import Joint
from problems.model.scene import JointScene, Scene
from problems.model.stage_answers import last_scene, stage_scenes
from problems.reporter import SILENT, Reporter
from report.document.numbers import counted

from .solution import Source, load_scene


def validate(scene: Source, *, reporter: Reporter = SILENT) -> Size | None:
    """Check a scene without solving it.

    Parameters
    ----------
    scene : Scene, str, Path or dict
        The scene, its name, the path of its file, or the content of its file.
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
    read, console = load_scene(scene), console_of(reporter)
    size = size_of(read)
    if read.output.stress:
        from .stress import refuse_unusable  # only what a scene calls for

        refuse_unusable(None, read)
    refuse_wrong_laws(read)
    if isinstance(read, JointScene) and isinstance(read.joint, Joint):
        assert size is not None
        _plates(read, read.joint, size, console)
    elif isinstance(read, JointScene):
        _superelements(read, console)
    else:
        _matrices(read, console)
    return size


def refuse_wrong_laws(scene: Scene) -> None:
    """Raise InputError for what is wrong in the table [random] of a scene."""
    if isinstance(scene, JointScene) and scene.random:
        from problems.load_cases.random_inputs import inputs_of  # only what a scene calls for

        if faults := inputs_of(scene, scene.random, stiffness=True)[1]:
            raise InputError(faults)


def _plates(scene: JointScene, joint: Joint, size: Size, console: Console) -> None:
    """Print parts, contacts and effects, and the memory of either form."""
    physical = physical_memory_mib()
    form = chosen_form(scene, FORMS, None).form
    console.print(f"{scene.name}: {scene.title}. Fine.")
    print_unusual(scene, console)
    table = Table("what", "how many", title="What will be built")
    for part in joint.part:
        table.add_row(
            f"part {part.name}", f"{joint.plate(part).size} unknowns, condensed onto {joint.node_count}"
        )
    nx, ny = joint.junction.nodes
    for first, second in joint.pairs:
        table.add_row(f"contact {first} – {second}", f"{joint.node_count} node pairs, {nx} × {ny}")
    console.print(_with_effects(table, scene))
    contacts = counted(size.m, "contact")
    console.print(f"n = {size.n} unknowns, m = {contacts}; this machine has {physical} MiB.")
    cached = "; the assembly is in the cache" if size.stored else ""
    console.print(
        f"Dense forms: K, its factors and Q take {size.dense_mib:.0f} MiB{cached}, the process up to "
        f"{size.dense_peak_mib:.0f} MiB."
    )
    console.print(
        f"Sparse form: {size.unknowns} unknowns, half-bandwidth {size.half_bandwidth}; the factors take "
        f"{size.sparse_mib:.0f} MiB, the process up to {size.sparse_peak_mib:.0f} MiB."
    )
    console.print(f"One load case is solved in the {form} form, unless another is asked for.")
    if size.m == 0:
        console.print("No contact: a linear solve, without a quadratic program.")


def _matrices(scene: Scene, console: Console) -> None:
    """Print the sizes and digits of given matrices. Raises InputError if K is not positive definite."""
    choice = chosen_form(scene, FORMS, None)
    if choice.form == "sparse":
        console.print(f"Sparse form by default: {choice.why}.")
    assembly = prepared(last_scene(scene), form=choice.form).assembly
    print_facts(scene.name, assembly, console)
    digits = digits_of(scene, assembly)
    console.print(f"K is symmetric and positive definite, its entries seem to have {digits} digits. Fine.")


def _superelements(scene: JointScene, console: Console) -> None:
    """Print parts and contacts, sizes and digits. Raises InputError if K is not positive definite."""
    from problems.model.superelement_joint import SuperelementJoint  # of such scenes only
    from problems.model.superelement_rows import first_rows

    joint = scene.joint
    assert isinstance(joint, SuperelementJoint)
    table = Table("what", "how many", title="What will be built")
    for part in joint.parts:
        nodes = counted(len(part.contacts), "contact node")
        table.add_row(f"part {part.name}", f"{part.size} unknowns, {nodes}")
    for (a, b), pairing in joint.pairings.items():
        beyond = f", {pairing.beyond} more beyond {b}" if pairing.beyond else ""
        table.add_row(f"contact {a} – {b}", f"{counted(len(pairing.nodes), 'node')} of {a}{beyond}")
    print_unusual(scene, console)
    console.print(_with_effects(table, scene))
    for part in joint.parts:
        rows = first_rows(part.nodes, (part.node, part.dof))
        console.print(Text(f"First rows of K of {part.name}: {rows}."))
    x, y, normal = (", ".join(f"{value + 0.0:.12g}" for value in axis.round(12)) for axis in joint.axes)
    console.print(f"Points are given along x = ({x}) and y = ({y}); the normal of their plane is ({normal}).")
    _matrices(scene, console)


def print_unusual(scene: Scene, console: Console) -> None:
    """Print what may be, but is rarely meant."""
    for sentence in scene.unusual:
        console.print(Text(f"{sentence}.", style="yellow"))


def _with_effects(table: Table, scene: JointScene) -> Table:
    for effect in scene.effects:
        name = f" {effect.name}" if effect.name else ""
        table.add_row(f"effect {effect.kind}{name}", docstring(type(effect)).partition("\n")[0])
    if scene.stages:
        earlier: dict[str, JointScene] = {}
        for name, part in stage_scenes(scene).items():
            like = next((first for first, one in earlier.items() if same_stiffness(part, one)), None)
            earlier |= {name: part} if like is None else {}
            acts = ", ".join(_counted(effect, scene.joint) for effect in part.effects)
            table.add_row(f"stage {name}", acts + (f"; K of {like}" if like is not None else ""))
    return table


def _counted(effect: Effect, joint: AnyJoint) -> str:
    """The name or kind of an effect, with the number of its points if it has some."""
    count = effect.element_count(joint)
    return f"{effect.name or effect.kind}{f' ({count})' if count else ''}"


def print_facts(name: str, assembly: Assembly, console: Console) -> None:
    """Print the sizes, and what reading has changed. Raises InputError if K is not positive definite."""
    assembly.K.ensure_factored()
    blocks = ", ".join(str(K.shape[0]) for K in assembly.K.matrices)
    console.print(f"{name}: matrices, n = {assembly.n}, m = {assembly.m}, blocks of {blocks}.")
    for note in assembly.notes:
        console.print(f"{note}.", style="yellow")


def digits_of(scene: Scene, assembly: Assembly) -> int:
    """The digits that the entries of K seem to have, at most 16: the fewest of a superelement or a block."""
    parts = getattr(getattr(scene, "joint", None), "parts", ())  # without the springs between them
    given = [part.stiffness for part in parts] or assembly.K.matrices
    return min(apparent_digits(K.data if sp.issparse(K) else K) for K in given)


def digits_sentence(problem: ReferenceProblem, solved: bool) -> tuple[str, bool]:
    """A sentence on the digits of K, and whether they are too few for 1e-7 mm at the answer.

    solved : at the reference; else at displacements of about its size.
    """
    data = problem.prepared
    digits = digits_of(problem.scene, data.assembly)
    if digits == DOUBLE:
        return "The entries of K have all digits of double precision", False
    if solved:
        x, lam = problem.reference.x, problem.reference.lam
    else:
        x, lam = estimated_displacements(data, problem.load), np.zeros(data.assembly.m)
    error = expected_error(data, x, lam, digits)
    text = f"The entries of K seem to have {digits} digits: if they were rounded, displacements are off by"
    few = error > LIMIT_MM
    more = f", more than {LIMIT_MM:g} mm: export it with more digits" if few else ""
    return f"{text} about {error:.0e} mm{more}", few
