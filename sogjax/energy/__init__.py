"""How well a posed body explains the pictures (Section 4.4, 4.5, 5.1): a sum of terms."""

from sogjax.energy.frame_energy import FrameEnergy, standard_terms, still_energy
from sogjax.energy.limits import LimitPenalty
from sogjax.energy.posed import Frame, History, Posed
from sogjax.energy.similarity import Similarity
from sogjax.energy.smoothness import AccelerationPenalty
from sogjax.energy.term import Penalty, Term, Terms
from sogjax.energy.views import Views, whole_image_overlap

__all__ = [
    "AccelerationPenalty",
    "Frame",
    "FrameEnergy",
    "History",
    "LimitPenalty",
    "Penalty",
    "Posed",
    "Similarity",
    "Term",
    "Terms",
    "Views",
    "standard_terms",
    "still_energy",
    "whole_image_overlap",
]
