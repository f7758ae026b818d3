"""Every method answers through the same interface, and the fins' own laws judge them all.

You will see error, power, effort and time of six methods on one target.
"""

import finlab

METHODS = ("dual", "mdn", "paper", "analytic", "qp", "sqp")


def main() -> None:
    layout = finlab.load_layout("A")
    print(f"{'method':<10}  err_norm  power [W]   effort        ms")
    for method in METHODS:
        allocator = finlab.Allocator(layout, method)
        allocator.allocate([1, 0, 0, 0, 0, 0])  # the first call is slower
        result = allocator.allocate([1, 0, 0.5, 0, 0, 0.1], seed=0)
        costs = f"{result.power:9.3f}  {result.effort:7.3f}"
        print(f"{method:<10}  {result.err_norm:8.1e}  {costs}  {result.solve_ms:8.1f}")


if __name__ == "__main__":
    main()
