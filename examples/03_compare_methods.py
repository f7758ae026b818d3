"""Every method answers through the same interface, and the analytic fin model judges them all.

You will see error, effort and time of five methods on one target.
"""

import finlab

METHODS = ("dual", "paper", "analytic", "qp", "sqp")


def main() -> None:
    layout = finlab.load_layout("A")
    print(f"{'method':<10}  err_norm   effort        ms")
    for method in METHODS:
        allocator = finlab.Allocator(layout, method)
        allocator.allocate([1, 0, 0, 0, 0, 0])  # the first call is slower
        result = allocator.allocate([1, 0, 0.5, 0, 0, 0.1], seed=0)
        print(f"{method:<10}  {result.err_norm:8.1e}  {result.effort:7.3f}  {result.solve_ms:8.1f}")


if __name__ == "__main__":
    main()
