"""What the report shows and what it does not: to be read before any number."""

from finlab.evaluation.report.document import Block
from finlab.evaluation.report.plan import N_STARTS
from finlab.evaluation.report.sizes import RERUN

SHOWN = (
    "How well methods **solve**: the commands that they find for a wrench, scored by the fins' own laws or "
    "tables, which all methods but `paper` were given. *Who knows what* says in which form.",
    "What **learning the physics** costs: `paper` knows one fin law, from samples; its errors on other fins "
    "say that it was not given them, not that a network could not learn them.",
    "What answers **cost**, against methods that keep the same cost least, and against the best of "
    f"{N_STARTS} random starts of a solver that knows nothing of ours. `analytic` finds the least forces "
    "and the cheapest amplitude and frequency for each; it divides forces without looking at their cost, so "
    "its figures stand in the tables and not among those that lead or trail.",
    "How a **simulated robot** swims when body, water, sensors, fins and path are not what its designer "
    "assumed, with one controller and one rule for its gains, whatever method allocates.",
)
NOT_SHOWN = (
    "No robot swam and no fin was measured for this report. Fin laws are means over a cycle in still water; "
    "fins neither feel each other nor the robot's speed, but on the hard days that say so (`wake`, "
    "`inflow`, `flexible`), whose strength is our choice.",
    "Watts are mechanical, by the fins' laws; in the closed loop with the losses of an assumed motor. No "
    "battery was measured.",
    "Figures marked *printed* are the paper's, from its own simulator, its own surrogate and a pool, on "
    "robots and paths that it does not describe. They stand beside ours; that ours are smaller or larger "
    "does not make a method better or worse than the paper's was there. Most of the distance to its errors "
    "is that we give methods the law that scores them, and the paper learns it.",
    "Times are of this machine, one core, one call at a time; none is of a robot's processor.",
)


def scope_blocks(seed: int) -> list[Block]:
    """The whole section.

    Args:
        seed: of the report.
    """
    choices = (
        "**`search`, `mdn` and the controller** were developed on seeds 0 to 99, on splits of the same kind "
        "as those here, and looked at with seeds 100 to 103 and 2026 to 2030; no seed of this report was "
        "used. Their numbers are in the code, one set for all layouts.",
        "**`paper`** was trained on random layouts of 2 to 5 fins of the law `drag`, and tuned on nothing "
        "else; its checkpoint's card says what was printed and what was done.",
        "**Baselines** run as strong as we could make them: `sqp` and `multistart` keep the same cost least "
        "as `search`, `analytic` takes the cheapest command of each force, the solvers of SciPy and IPOPT "
        "start from 8 points (32 as yardstick). All know the same limits, failures and fin laws.",
        f"**Reruns**: this report's draws begin with seed {seed}; *rerun* in the tables of wrench tracking "
        f"is seed {seed + RERUN}. Small print below a number says where a rerun lands.",
    )
    return [
        "## What is shown",
        "\n".join(f"- {sentence}" for sentence in SHOWN),
        "### What is not shown",
        "\n".join(f"- {sentence}" for sentence in NOT_SHOWN),
        "### Who was tuned on what",
        "\n".join(f"- {sentence}" for sentence in choices),
    ]
