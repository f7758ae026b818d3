"""What each method knows of the fins, and what scores its answers: to be read before the numbers."""

from finlab.evaluation.report.document import Block, Column, Row, Table, method_row

EXACT = "each fin's own law or table, as the plant has it"
KNOWS = {
    "search": ("compiled for the search, then that law itself", "none"),
    "mdn": ("compiled for the search, then that law itself", "proposes where the search begins"),
    "paper": (
        "a network trained on forward samples of the law `drag`, whatever the fins are",
        "the whole method",
    ),
    "analytic": ("compiled: each force of a pseudo-inverse is looked up", "none"),
    "qp": ("linearized once per layout, at the middle of the limits", "none"),
    "sqp": ("linearized at every iterate", "none"),
    "multistart": ("with its exact slopes", "none"),
    "trf": ("with its exact slopes", "none"),
    "slsqp": ("with its exact slopes", "none"),
    "ipopt": ("as symbols; tables as callbacks", "none"),
    "on-board": ("the thrust law at a fixed frequency", "none"),
}
"""Method -> in which form it was given the fins' physics, and what a network does in it."""


def method_blocks() -> list[Block]:
    """The whole section."""
    columns = (
        Column("method", "method"),
        Column("physics", "physics it was given"),
        Column("network", "network"),
    )
    rows: list[Row] = []
    for method, (form, network) in KNOWS.items():
        physics = form if method == "paper" else f"{EXACT}, {form}"
        rows.append(method_row({"method": method, "physics": physics, "network": network}))
    return [
        "## Who knows what",
        (
            "Every answer is scored by the plant: the fins' own laws, or their tables, the same for all "
            "methods, whatever a method's model says. Three places say otherwise where they stand: the "
            "ablation scores by the paper's surrogate as well, the temperature by the surrogate alone, and "
            "in the closed loop a simulated body says where the robot swam. All methods but `paper` were "
            "given the physics that scores them, so their errors show how well they solve, not how well a "
            "model fits a fin in the water."
        ),
        Table(columns, rows),
    ]
