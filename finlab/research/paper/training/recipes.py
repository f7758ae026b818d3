"""Named recipes: `paper` (the printed numbers, our choices elsewhere), `shipped` (the weights that
come with finlab, one to two hours of one core), `short` (20 minutes on two cores) and `smoke`
(seconds); and the model card of what they make."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from finlab.errors import DataError
from finlab.research.networks.trained import TrainedWeights
from finlab.research.paper.network import NetworkConfig
from finlab.research.paper.surrogate import SurrogateConfig
from finlab.research.paper.training.samples import DataSettings
from finlab.research.training.loop import LoopSettings
from finlab.whole_file import write_whole


@dataclass(frozen=True)
class PaperLoop(LoopSettings):
    """How one of the two networks is trained."""

    float32: float = 0.0
    """Share of the steps, the last ones, whose products are in float32 on every device. At small
    rates weights come to make up for the rounding of products in bfloat16, which answers do not
    have."""
    one_layout: bool = False
    """Whether a step sees commands of one random layout, as printed of the surrogate, or of
    many."""

    def is_float32(self, step: int) -> bool:
        """Whether the products of a step are in float32 on every device."""
        return step >= (1.0 - self.float32) * self.steps


@dataclass(frozen=True)
class AllocatorTraining(PaperLoop):
    """How the network is trained: L = L_imit + beta L_guide + lambda L_ent (Eq. 7)."""

    guidance: float = 1000.0
    """Final weight beta; not printed."""
    guidance_start: float = 0.01
    """Weight beta at the first step; not printed."""
    ramp: float = 0.5
    """Share of the steps over which beta grows linearly; not printed."""
    entropy: float = 0.01
    """Weight lambda; not printed."""

    def beta(self, step: int) -> float:
        """Weight beta of the guidance in a step: it rises linearly over `ramp`, then stays."""
        ramp = min(1.0, step / max(1.0, self.ramp * self.steps))
        return self.guidance_start + ramp * (self.guidance - self.guidance_start)


@dataclass(frozen=True)
class PaperRecipe:
    """The paper's two networks, and what they learn from."""

    data: DataSettings
    surrogate_training: PaperLoop
    allocator_training: AllocatorTraining
    surrogate: SurrogateConfig = field(default_factory=SurrogateConfig)
    network: NetworkConfig = field(default_factory=NetworkConfig)
    normalization: str | None = None
    """Name of the shipped checkpoint whose wrench normalization is taken, so that errors of all
    shipped networks are on one scale; None for that of the data, as printed."""


RECIPES = {
    "paper": PaperRecipe(
        DataSettings(),
        PaperLoop(115_000, 4096, 1e-3, warmup=100, ema=0.99, one_layout=True),
        AllocatorTraining(115 * (5_000_000 // 16_384), 16_384, 1e-4, cosine=False),  # 115 epochs
    ),
    "shipped": PaperRecipe(
        DataSettings(100_000, 50),
        # With Adam the error was twice as large after as much time.
        PaperLoop(30_000, 1024, 3e-3, warmup=100, ema=0.99, optimizer="soap", float32=0.3),
        AllocatorTraining(6_000, 512, 2e-3, warmup=100, ema=0.99, optimizer="soap", guidance=30.0),
        SurrogateConfig(hidden=(512, 64, 64)),
        normalization="default",
    ),
    "short": PaperRecipe(
        DataSettings(20_000, 200),
        # Many small steps and a third hidden layer learn more in the same time than few large ones.
        PaperLoop(48_000, 256, 2e-3, warmup=100, ema=0.99),
        # With a guidance of 10 and twice the rate, narrow components made a run diverge half-way.
        AllocatorTraining(8_000, 256, 5e-4, warmup=100, ema=0.99, guidance=3.0),
        SurrogateConfig(hidden=(512, 64, 64)),
    ),
    "smoke": PaperRecipe(
        DataSettings(200, 200),
        PaperLoop(3000, 256, 3e-3, warmup=20, ema=0.9),
        AllocatorTraining(150, 128, 2e-3, warmup=10, ema=0.9, guidance=1.0),
        SurrogateConfig(hidden=(64, 32, 32)),
        NetworkConfig(
            width=32, heads=2, graph_layers=1, transformer_layers=1, feedforward=64, n_components=4
        ),
    ),
}
"""Name -> recipe of `finlab train surrogate` and `finlab train allocator`."""


def recipe(preset: str) -> PaperRecipe:
    """A recipe by its name. Raises DataError: there is none of that name."""
    if preset not in RECIPES:
        raise DataError(f"preset: expected one of {', '.join(RECIPES)}, got {preset!r:.40}")
    return RECIPES[preset]


def recipe_hash(made: PaperRecipe, verb: str) -> str:
    """Returns the SHA-256 of all numbers of a recipe that one training depends on.

    Args:
        made: the recipe.
        verb: "surrogate" or "allocator".
    """
    values = asdict(made)
    numbers = [made.normalization, values["data"], values[f"{verb}_training"]]
    numbers.append(values["surrogate" if verb == "surrogate" else "network"])
    return hashlib.sha256(json.dumps(numbers, sort_keys=True).encode()).hexdigest()


CARD_FILE = "README.md"
RUN_AGAIN = """
**Made again** by `finlab train surrogate -o DIR/surrogate --preset {preset}` and, for a network,
`finlab train allocator -o DIR/NAME --preset {preset} --surrogate DIR/surrogate`: without a clock,
each step a function of its number and the seed. Two runs on one kind of processor with the same
versions of the libraries end with the same bytes; others round otherwise, and end with weights of
the same worth.
"""
"""How the weights are made again."""
PRINTED = {
    "surrogate data layouts": "1000",
    "surrogate data commands": "5000",
    "surrogate training one layout": "True",
    "allocator data layouts": "1000",
    "allocator data commands": "5000",
    "allocator training batch size": "16384",
    "allocator training learning rate": "0.0001, as it is",
    "allocator training guidance": "from a small weight to a final one",
    "allocator samples": "575 million (115 epochs)",
    "network width": "128",
    "network heads": "4",
    "network graph layers": "2",
    "network transformer layers": "3",
    "network n components": "8",
    "surrogate sizes hidden": "512",
}
"""What the paper prints of the numbers below; of the others nothing."""
CHOICES = """
Choices that the paper leaves open, in the surrogate: further hidden layers, SiLU between layers,
outputs in units of 4 N, wide first weights, tanh in the pooled descriptor. In the network:
residual connections around GATv2, a linear layer from node and wrench to the Transformer's width,
normalization before each block, log sigma through a tanh. In training: one sample per target in
the guidance, whose gradient passes the clamp and does not reach the mixture's weights; entropy as
the mean over fins; gradients clipped at norm 1; matrix products in bfloat16 where the device is
faster with it. In inference: weights of J_en 1, 1, 0.1 and 1, gamma 1e-4, four refined candidates,
160 steps of Adam whose rate falls linearly from 0.03 of half a range to a twentieth of that, of
which the best is kept (`PaperSettings`).

Where it departs from the print: zero directions outside their arc are taken to the nearest turn
before the clamp, and turn on beyond the seam in Adam; J_en divides each command by its own fin's
upper limit, where the paper takes that of the data set; the random start of the ablation is the
best four of 64 uniform draws, where the paper's is *a* random feasible one.

For the method `paper` and its ablation; use `dual` for work. What the networks are worth beside the
printed figures is in the report of `finlab eval report`, with seeds and numbers of targets.

`log.csv` and `curves.png` show the training; `config.json` holds the same numbers.
"""


def write_card(folder: Path, weights: TrainedWeights) -> None:
    """Write the model card of a checkpoint of the paper's kind. Raises DataError: it cannot be
    written."""
    parts = [*weights.training.items(), ("network", weights.network_sizes)]
    parts += [("surrogate sizes", weights.surrogate_sizes), *weights.metrics.items()]
    rows = [row for name, part in parts for row in _rows(name, part)]
    table = "\n".join(f"| {name} | {PRINTED.get(name, '')} | {value} |" for name, value in rows)
    what = "Surrogate" if weights.network_sizes is None else "Network and surrogate"
    text = (
        f"# Model card: `{weights.name}`\n\n{what} of method `paper`, preset `{weights.preset}`.\n"
        f"Weights: SHA-256 {weights.sha256}.\n\n| | printed | done "
        f"|\n|---|---|---|\n{table}\n{RUN_AGAIN.format(preset=weights.preset)}{CHOICES}"
    )
    write_whole(folder / CARD_FILE, text, DataError)


def _rows(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Each number or word below a name that says something, with its path."""
    if isinstance(value, Mapping):
        for key, part in value.items():
            yield from _rows(f"{name} {key}".replace("_", " "), part)
    elif value not in (None, ""):
        yield name, value
