"""From a load cell's noisy file to an exact allocation: a fin that no formula describes.

You will see what the fit is worth, and a command for each fin of layout A, were they all such fins.
"""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import finlab
from finlab.fit import fit_fin, read_measurements, write_fin
from finlab.fit.fin_fit import summary
from finlab.layout import FinModelSpec

DATA = Path(__file__).with_name("soft_fin.csv")


def main() -> None:
    fit = fit_fin(read_measurements([DATA]))
    print("\n".join(summary(fit)))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "fin.csv"
        write_fin(fit, path)
        model = FinModelSpec("table", (("path", str(path)),))
        layout = finlab.load_layout("A")
        layout = replace(layout, actuators=tuple(replace(fin, model=model) for fin in layout.fins))
        result = finlab.Allocator(layout).allocate([1, 0, 0.5, 0, 0, 0.1])
        print(result)


if __name__ == "__main__":
    main()
