"""`finlab data generate`: the paper's data set."""

from pathlib import Path
from typing import Annotated

from tyro.conf import arg
from tyro.extras import SubcommandApp

from finlab.cli.inputs import check_positive

verbs = SubcommandApp()

_Count = Annotated[int, arg(metavar="N")]


@verbs.command
def generate(
    output: Annotated[Path, arg(metavar="FOLDER", aliases=["-o"])],
    layouts: _Count = 1000,
    commands: _Count = 5000,
    seed: _Count = 0,
    varied_limits: Annotated[float, arg(metavar="SHARE")] = 0.5,
    fin_model: Annotated[str, arg(metavar="NAME|FILE.csv")] = "drag",
) -> None:
    """Draw random layouts and commands, and write them with the wrenches that they cause.

    A run that was stopped goes on when it is called again with the same arguments.

    Args:
        output: folder for the data set.
        layouts: random layouts of 2 to 5 fins.
        commands: random commands on each of them.
        seed: of all draws.
        varied_limits: share of the layouts whose fins have limits of their own.
        fin_model: what causes the wrenches: drag, lighthill, soft, or a table of measured forces.
    """
    from finlab.errors import CommandError
    from finlab.layout import FinModelSpec
    from finlab.paper.training.samples import DataSettings, generate

    check_positive(layouts=layouts, commands=commands)
    if seed < 0 or not 0.0 <= varied_limits <= 1.0:
        raise CommandError(f"expected a seed from 0 and a share from 0 to 1, got {seed} and {varied_limits}")
    table = (("path", str(Path(fin_model).resolve())),)
    model = FinModelSpec("table", table) if fin_model.lower().endswith(".csv") else FinModelSpec(fin_model)
    generate(output, DataSettings(layouts, commands, seed, varied_limits, model))
    print(f"{output}: {layouts} layouts with {commands} commands each, seed {seed}")
