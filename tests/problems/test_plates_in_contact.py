"""Plates in contact against other codes: two scenes of the gallery, and a joint of unlike parts.

The triangles are scikit-fem's, on a mesh that does not contain the scene's nodes; Clarabel finds the
contacts. The scenes of the gallery are symmetric about the contact, or the middle part; the joint of
docs/effects.md is not. docs/outside.md has finer meshes, by draw_plates_in_contact.py.
"""

import pytest
from long import ASKED
from plates_in_contact import initial_gap, question

NAMES = ["gallery/three-part-stack", "docs/effects.md", *(["gallery/measured-gap"] if ASKED else [])]
ELEMENT = 25.0  # mm, where the scenes have a node every 15 mm


@pytest.mark.parametrize("name", NAMES)
def test_gaps_and_reactions_agree(name: str) -> None:
    asked = question(name)
    ours = asked.ours()
    before = initial_gap(asked.scene).reshape(ours.gaps.shape)
    assert (before - ours.gaps).max() > 0.2 * before.max()  # the fasteners close it in part
    assert 0.03 < (ours.gaps < 1e-9).mean() < 0.5
    of_gaps, of_reactions = ours.apart(asked.theirs(ELEMENT))
    assert of_gaps < 0.01
    assert of_reactions < 0.005
