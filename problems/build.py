"""From a scene to its problem in one of the forms: the matrices that load cases share, and a load case.

The dense forms condense the model onto the junction; the sparse form takes it as it is. Only the code of the
road that is taken is imported.
"""

from __future__ import annotations

from problems.forms.assembly import LoadCase
from problems.forms.names import Form
from problems.forms.prepared import Prepared
from problems.forms.problem import Progress
from problems.model.scene import MadeScene, Scene


def prepared(scene: Scene, progress: Progress = lambda text, fraction: None, form: Form = "dual") -> Prepared:
    """K and A of a scene, condensed from the cache or now, or as they are for the sparse form.

    Factors and Q are made when first needed. Raises InputError if a part can move freely, if a user's
    matrices are invalid, or if contacts of a rung depend on one another.
    """
    if isinstance(scene, MadeScene):
        from problems.input.dependent_contacts import refuse_dependent

        refuse_dependent(scene.made.assembly.A, scene.source_of("A"))
    if form == "sparse":
        from problems.uncondensed import build as uncondensed

        return uncondensed.prepared(scene)
    from problems.condensation import build as condensed

    return condensed.prepared(scene, progress)


def load_case(scene: Scene, form: Form = "dual") -> LoadCase:
    """f, an entry per unknown of K, and g: the sum of the scene's effects' terms, or the user's own."""
    if form == "sparse":
        from problems.uncondensed import build as uncondensed

        return uncondensed.load_case(scene)
    from problems.condensation import build as condensed

    return condensed.load_case(scene)
