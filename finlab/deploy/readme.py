"""The README of a bundle: what it is, and the lines that run it."""

from __future__ import annotations

import finlab
from finlab.deploy.graph import LayoutGraph

_TEXT = """\
# {name}: control allocation on board

Made by finlab {version} with checkpoint `{checkpoint}`. Target wrench in, one command per fin out, in about a
millisecond; finlab without its extras is enough, no torch.

## Five lines that run it

```
python3 -m venv robot
robot/bin/pip install numpy safetensors
robot/bin/pip install --no-deps finlab-{version}-py3-none-any.whl
robot/bin/finlab-runtime check .
robot/bin/finlab-runtime allocate . --wrench 1 0 0.5 0 0 0.1
```

`check` compares this computer's answers with those of the computer that made the bundle; run it before first
use. `robot/bin/finlab-runtime serve .` reads targets as JSON lines and writes commands. In Python:

```python
import finlab

robot, allocator = finlab.load_layout("."), finlab.load_allocator(".")
answer = allocator.allocate(robot, [1, 0, 0.5, 0, 0, 0.1], failed={failed})
print(answer.fins, answer.command)
```

## The robot

Body frame: x forward, y left, z up, origin at the centre of gravity. A wrench is `[Fx, Fy, Fz, Tx, Ty, Tz]`
in N and N m. A command is half amplitude [rad], frequency [Hz] and zero direction [rad] (0 pushes along the
fin's horizontal axis, pi/2 up).

| fin | position [m] | shaft [rad] | amplitude [rad] | frequency [Hz] | zero direction [rad] | works |
|---|---|---|---|---|---|---|
{fins}

## The files

| file | what it is |
|---|---|
| `layout.graph.json` | fins, node features, normalization, self-tests; networkx reads its part `graph` |
| `bundle.json` | version of the bundle, and the settings that the allocator is made with |
| `checkpoint/` | the trained networks: `model.safetensors`, `config.json`; `fast/` for `--fast` |
| `SHA256SUMS` | checksums; `sha256sum -c SHA256SUMS` checks them without finlab |
"""


def readme_text(graph: LayoutGraph) -> str:
    """The README of a bundle with this graph."""
    rows = []
    for fin in graph.layout.fins:
        x, y, z = fin.position
        ranges = (
            f"{low:.4g}..{high:.4g}" for low, high in zip(fin.limits.lower, fin.limits.upper, strict=True)
        )
        works = "no" if fin.name in graph.failed else "yes"
        name = fin.name.replace("|", "\\|")
        rows.append(
            f"| {name} | {x:g}, {y:g}, {z:g} | {fin.mounting_angle:.4f} | {' | '.join(ranges)} | {works} |"
        )
    return _TEXT.format(
        name=graph.layout.name,
        version=finlab.__version__,
        checkpoint=graph.checkpoint,
        fins="\n".join(rows),
        failed=list(graph.failed),
    )
