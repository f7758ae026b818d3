"""Control allocation: a target wrench in, one command per fin out."""

from finlab.allocation.allocation import Allocation as Allocation
from finlab.allocation.allocation import BatchAllocation as BatchAllocation
from finlab.allocation.allocator import Allocator as Allocator
from finlab.allocation.methods import METHODS as METHODS
from finlab.allocation.policy import Policy as Policy
from finlab.allocation.solution import Candidates as Candidates
from finlab.allocation.solution import Solution as Solution
from finlab.layout.damage import Health as Health
