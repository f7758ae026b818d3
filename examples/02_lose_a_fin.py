"""A robot that loses fins goes on with the rest; nothing is trained again.

You will see the same target allocated to all four fins, to three, and to two, with the error each time.
"""

import finlab

TARGET = [0.5, 0, 0.5, 0, 0, 0.05]


def main() -> None:
    layout = finlab.load_layout("A")
    allocator = finlab.Allocator(layout)
    for failed in ([], ["front_right"], ["front_right", "back_left"]):
        result = allocator.allocate(TARGET, failed=failed, seed=0)
        lost = ", ".join(failed) or "none"
        missing = ", ".join(f"{value:+.2f}" for value in result.unallocated)
        print(f"lost: {lost:<22}  err_norm {result.err_norm:8.4f}  missing [{missing}]")


if __name__ == "__main__":
    main()
