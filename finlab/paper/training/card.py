"""The model card of a training of the paper's networks: what was printed, what was done, what was chosen."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from finlab.errors import DataError
from finlab.networks.trained import TrainedWeights
from finlab.whole_file import write_whole

CARD_FILE = "README.md"
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
Choices that the paper leaves open, in the surrogate: further hidden layers, SiLU between layers, outputs in
units of 4 N, wide first weights, tanh in the pooled descriptor. In the network: residual connections around
GATv2, a linear layer from node and wrench to the Transformer's width, normalization before each block, log
sigma through a tanh. In training: one sample per target in the guidance, whose gradient passes the clamp and
does not reach the mixture's weights; entropy as the mean over fins; gradients clipped at norm 1; matrix
products in bfloat16 where the device is faster with it. Of inference: see `PaperSettings`.

`log.csv` and `curves.png` show the training; `config.json` holds the same numbers.
"""


def write_card(folder: Path, weights: TrainedWeights) -> None:
    """Write the model card of a checkpoint of the paper's kind."""
    parts = [*weights.training.items(), ("network", weights.network_sizes)]
    parts += [("surrogate sizes", weights.surrogate_sizes), *weights.metrics.items()]
    rows = [row for name, part in parts for row in _rows(name, part)]
    table = "\n".join(f"| {name} | {PRINTED.get(name, '')} | {value} |" for name, value in rows)
    what = "Surrogate" if weights.network_sizes is None else "Network and surrogate"
    text = (
        f"# Model card: `{weights.name}`\n\n{what} of method `paper`, preset `{weights.preset}`.\n"
        f"Weights: SHA-256 {weights.sha256}.\n\n| | printed | done |\n|---|---|---|\n{table}\n{CHOICES}"
    )
    write_whole(folder / CARD_FILE, text, DataError)


def _rows(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Each number below a name, with its path."""
    if isinstance(value, Mapping):
        for key, part in value.items():
            yield from _rows(f"{name} {key}".replace("_", " "), part)
    elif value is not None:
        yield name, value
