"""How much of everything a report measures: `quick` in minutes, `full` at the paper's size."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Sizes:
    """Numbers of cases of a report."""

    name: str
    """`quick` or `full`."""
    main: tuple[int, int]
    """Layouts, and targets on each, of the splits that the paper has."""
    other: tuple[int, int]
    """Layouts, and targets on each, of the other splits."""
    slow_other: tuple[int, int]
    """Layouts, and first targets of each, for methods of a tenth of a second on the other splits."""
    cost: tuple[int, int]
    """Layouts and targets of each set, for the costs beside the best of 32 starts."""
    ablation: tuple[int, int]
    """Layouts and targets of the ablation."""
    temperature: tuple[int, int]
    """Layouts and targets at each temperature."""
    trained: tuple[int, int]
    """Layouts and targets on which the small trainings are tried."""
    latency: tuple[int, float]
    """Timed calls of each method, and the seconds after which a slow one stops."""
    training: tuple[str, int, int]
    """Preset, optimizer steps and samples per step of each small training."""
    swims: tuple[int, int, int]
    """Closed-loop runs of each case, with other noise: trajectories, faults, speeds; 0 leaves them out."""
    lost_pairs: bool
    """Whether pairs of lost fins swim too."""

    def of_split(self, *, main: bool, slow: bool) -> tuple[int, int]:
        """Layouts and targets of a split for a quick or a slow method."""
        if main:
            return (self.main[0], 1) if slow else self.main
        return self.slow_other if slow else self.other


SIZES = {
    "quick": Sizes(
        "quick",
        main=(30, 30),
        other=(20, 10),
        slow_other=(8, 1),
        cost=(6, 1),
        ablation=(20, 10),
        temperature=(15, 2),
        trained=(20, 10),
        latency=(40, 1.5),
        training=("smoke", 240, 128),
        swims=(1, 1, 1),
        lost_pairs=False,
    ),
    "full": Sizes(
        "full",
        main=(100, 1000),
        other=(100, 100),
        slow_other=(25, 1),
        cost=(40, 3),
        ablation=(100, 20),
        temperature=(100, 2),
        trained=(40, 25),
        latency=(200, 20.0),
        training=("paper", 400, 256),
        swims=(2, 1, 5),
        lost_pairs=True,
    ),
}
"""Name -> sizes."""
