"""The model card of a training of the paper's networks: what was printed, what was done, what was chosen."""

from pathlib import Path
from typing import Any

from finlab.errors import DataError
from finlab.networks.trained import TrainedWeights
from finlab.whole_file import write_whole

CARD_FILE = "README.md"

_CHOICES = """
Choices that the paper leaves open, in the surrogate: further hidden layers, SiLU between layers, outputs in
units of 4 N, wide first weights, tanh in the pooled descriptor. In the network: residual connections around
GATv2, a linear layer from node and wrench to the Transformer's width, normalization before each block, log
sigma through a tanh. In training: one sample per target in the guidance, whose gradient passes the clamp and
does not reach the mixture's weights; entropy as the mean over fins; gradients clipped at norm 1; matrix
products in bfloat16 where the device is faster with it. Of inference: see `PaperSettings`.
"""


def write_card(folder: Path, weights: TrainedWeights) -> None:
    """Write the model card of a checkpoint."""
    write_whole(folder / CARD_FILE, card(weights), DataError)


def card(weights: TrainedWeights) -> str:
    """The model card of a checkpoint of the paper's kind, in Markdown."""
    verbs, sizes = weights.training, weights.network_sizes
    rows = [row for verb, run in verbs.items() for row in _rows(verb, run)]
    if sizes is not None:
        done = f"GATv2 {sizes['graph_layers']}, Transformer {sizes['transformer_layers']}"
        rows.append(("network", "GATv2 2, Transformer 3", done))
        rows.append(("heads, width", "4, 128", f"{sizes['heads']}, {sizes['width']}"))
        rows.append(("components", "8", sizes["n_components"]))
    if weights.surrogate_sizes is not None:
        rows.append(("surrogate, hidden", "512", ", ".join(map(str, weights.surrogate_sizes["hidden"]))))
    rows += [
        (f"{part}: {name}", "", f"{x:.4g}") for part, m in weights.metrics.items() for name, x in m.items()
    ]
    table = "\n".join(f"| {name} | {printed} | {done} |" for name, printed, done in rows)
    what = "Network and surrogate" if sizes is not None else "Surrogate"
    return (
        f"# Model card: `{weights.name}`\n\n{what}, preset `{weights.preset}`, for method `paper`.\n"
        f"Weights: SHA-256 {weights.sha256}.\n\n| | printed | done |\n|---|---|---|\n{table}\n{_CHOICES}"
        "\n`log.csv` and `curves.png` show the training; `config.json` holds every setting.\n"
    )


def _rows(verb: str, run: dict[str, Any]) -> list[tuple[str, Any, Any]]:
    data, training, network = run["data"], run["training"], verb == "allocator"
    rate = f"{training['learning_rate']:g}" + (", falling along a cosine" if training["cosine"] else "")
    rows: list[tuple[str, Any, Any]] = [
        (
            "data",
            "1000 layouts x 5000 commands",
            f"{data['layouts']} x {data['commands']}, seed {data['seed']}",
        ),
        ("layouts with limits of their own", "", f"{data['varied_limits']:g}"),
        ("fin model", "", data["fin_model"]["type"]),
        ("samples", "575 million" if network else "", run["samples"]),
        ("batch", "16384" if network else "", training["batch_size"]),
        ("learning rate (Adam)", "0.0001" if network else "", rate),
        ("running average of the weights", "", f"{training['ema']:g}"),
    ]
    if network:
        ends = f"{training['guidance_start']:g} to {training['guidance']:g}"
        beta = f"{ends}, over a share {training['ramp']:g} of the steps"
        rows += [("guidance beta", "a linear ramp", beta), ("entropy lambda", "", f"{training['entropy']:g}")]
    else:
        layouts = "one" if training["one_layout"] else "mixed"
        rows.append(("layouts in a step", "one", layouts))
    rows.append(("seed, processes", "", f"{run['seed']}, {run['processes']}"))
    return [(f"{verb}: {name}", printed, done) for name, printed, done in rows]
