"""What the report shows and what it does not: to be read before any number."""

from finlab.evaluation.report.document import Block
from finlab.evaluation.report.plan import N_STARTS
from finlab.evaluation.report.sizes import RERUN, SEED

SHOWN = (
    "How well methods **solve**: the commands that they find for a wrench, scored by the fins' own laws or "
    "tables, which all methods but `paper` were given. *Who knows what* says in which form.",
    "What **learning the physics** costs: `paper` has learned one fin law, from samples; its errors on other "
    "fins show that these were not in its training, not that a network could not learn them.",
    "What answers **cost**, against methods that keep the same cost least, and against the best of "
    f"{N_STARTS} random starts of a solver that shares nothing with our search. `analytic` finds the least "
    "forces and the cheapest amplitude and frequency for each; it divides forces without looking at their "
    "cost, so its figures stand in the tables of cost, and are not counted among those that lead or trail "
    "there.",
    "How a **simulated robot** swims: on the hard days, where body, water, sensors, fins or path are not "
    "what its designer assumed, with one controller and one rule for its gains; in the experiments of the "
    "paper with controllers after its two, whose gains it does not print. Whatever method allocates, the "
    "controller is the same; on the hard days `search` takes from it the wrenches that it expects, the "
    "others the present one.",
)
NOT_SHOWN = (
    "No robot swam and no fin was measured for this report. Fin laws are means over a cycle in still water. "
    "Neither other fins nor the robot's speed change a fin's force, except on the hard days `wake` and "
    "`inflow`; on `flexible` fins have soft tips. How strong these effects are is our choice.",
    "Watts are mechanical, by the fins' laws; in the closed loop with the losses of an assumed motor. No "
    "battery was measured.",
    "Figures marked *printed* are the paper's, from its own simulations and a pool; which model scored its "
    "wrench tracking and its ablation it does not say. It prints neither the mass and damping of its robots, "
    "nor the size and speed of the paths that they tracked, nor how the targets of wrench tracking were "
    "drawn, nor how far its layouts OOD lie outside. Its figures stand beside ours; that ours are smaller or "
    "larger does not make a method better or worse than the paper's was there. All methods but `paper` are "
    "given the law that scores them, which the paper's method has to learn. `paper` is our training of the "
    "paper's method and learns the law, too; we do not know why its errors of wrench tracking lie below the "
    "printed ones.",
    "Times are of this machine, one core; *Time per call* measures single calls with nothing beside them. "
    "No time is of a robot's processor.",
)


def scope_blocks(seed: int) -> list[Block]:
    """The whole section.

    Args:
        seed: of the report.
    """
    choices = (
        "**`search`, `mdn` and the controller** were developed on seeds 0 to 103, on splits and days of the "
        "same kind as those here, and checked on seeds 2026 to 2030. Their constants are in the code, one "
        f"set for all layouts. Seed {SEED}, with which a report begins unless another one is given, was kept "
        "apart, with one exception: first runs of the hard days on it showed that `search` took more power "
        "in a current, and that two fins lost at one moment were not found. The controller's look-ahead and "
        "the monitor were then changed, by runs on seeds 100 and 101, and those days were run again.",
        "**`paper`** was trained on random layouts of 2 to 5 fins of the law `drag`, and its settings were "
        "chosen on such layouts; its checkpoint's card says what was printed and what was done.",
        "**Baselines** run as strong as we could make them: `sqp` and `multistart` lower the same cost as "
        "`search` keeps least, from 5 and 16 starts, `analytic` takes the cheapest command of each force, "
        "the solvers of SciPy and IPOPT start from 8 points (32 as yardstick). All are given the same "
        "limits, failures and fin laws; the pseudo-inverses `analytic` and `on-board` heed limits only by "
        "clipping or scaling what they find.",
        f"**Reruns**: this report's draws begin with seed {seed}; *rerun* in the tables of wrench tracking "
        f"is seed {seed + RERUN}. Small print below a number says where a rerun should land.",
    )
    return [
        "## What is shown",
        "\n".join(f"- {sentence}" for sentence in SHOWN),
        "### What is not shown",
        "\n".join(f"- {sentence}" for sentence in NOT_SHOWN),
        "### Who was tuned on what",
        "\n".join(f"- {sentence}" for sentence in choices),
    ]
