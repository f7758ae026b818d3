"""Abilities of a layout, and their improvement: authority, attainable sets, power, score cards,
capability plots, optimization.

It works from the actuators' own laws with numpy and scipy.
"""

from finlab.analysis.authority import AXES as AXES
from finlab.analysis.authority import Authority as Authority
from finlab.analysis.authority import Loss as Loss
from finlab.analysis.authority import authority as authority
from finlab.analysis.authority import losses as losses
from finlab.analysis.capability import Capability as Capability
from finlab.analysis.capability import capability as capability
from finlab.analysis.capability import dp_capability as dp_capability
from finlab.analysis.goals import GOALS as GOALS
from finlab.analysis.keep_out import KeepOut as KeepOut
from finlab.analysis.layout_bound import LayoutBound as LayoutBound
from finlab.analysis.layout_bound import layout_bound as layout_bound
from finlab.analysis.layout_search import Progress as Progress
from finlab.analysis.moves import Bounds as Bounds
from finlab.analysis.moves import mirror_pairs as mirror_pairs
from finlab.analysis.optimize import Improvement as Improvement
from finlab.analysis.optimize import optimize_layout as optimize_layout
from finlab.analysis.score_card import ScoreCard as ScoreCard
from finlab.analysis.score_card import least_power as least_power
from finlab.analysis.score_card import score_card as score_card
from finlab.analysis.second_losses import SecondLoss as SecondLoss
from finlab.analysis.second_losses import second_losses as second_losses
from finlab.analysis.ship_file import Ship as Ship
from finlab.analysis.ship_file import read_ship as read_ship
from finlab.forces.attainable import AttainableSet as AttainableSet
from finlab.forces.attainable import attainable_set as attainable_set

__all__ = [
    "AXES",
    "GOALS",
    "AttainableSet",
    "Authority",
    "Bounds",
    "Capability",
    "Improvement",
    "KeepOut",
    "LayoutBound",
    "Loss",
    "Progress",
    "ScoreCard",
    "SecondLoss",
    "Ship",
    "attainable_set",
    "authority",
    "capability",
    "dp_capability",
    "layout_bound",
    "least_power",
    "losses",
    "mirror_pairs",
    "optimize_layout",
    "read_ship",
    "score_card",
    "second_losses",
]
