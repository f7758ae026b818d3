"""The curves of a training as a picture: each loss term over the steps."""

import io

CURVES_FILE = "curves.png"
APART = ("step", "samples", "seconds")
"""Columns of the log that are no curves."""


def curves(rows: list[dict[str, float]]) -> bytes | None:
    """A PNG of a log's columns over its steps; None without matplotlib, and of an empty log."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return None
    names = [name for name in rows[0] if name not in APART] if rows else []
    if not names:
        return None
    figure = Figure(figsize=(8.0, 2.0 * len(names)), layout="constrained")
    steps = [row["step"] for row in rows]
    for axes, name in zip(figure.subplots(len(names), sharex=True, squeeze=False)[:, 0], names, strict=True):
        values = [row[name] for row in rows]
        axes.plot(steps, values, linewidth=1.0)
        axes.set_yscale("log" if min(values) > 0.0 else "symlog")
        axes.set_ylabel(name.replace("_", " "))
        axes.grid(alpha=0.3)
    axes.set_xlabel("step")
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=100)
    return content.getvalue()
