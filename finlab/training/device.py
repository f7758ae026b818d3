"""Where training runs, and in which precision."""

import torch


def training_device() -> torch.device:
    """The graphics card where there is one, else the processor."""
    if not torch.cuda.is_available():
        return torch.device("cpu")
    # Matrix products of float32 in TensorFloat-32: their rounding is far below what is learned here.
    torch.set_float32_matmul_precision("high")
    return torch.device("cuda")


def autocast_dtype(device_type: str) -> torch.dtype | None:
    """bfloat16 where the hardware multiplies it faster than float32, else None.

    CPUs with bfloat16 instructions gain several times; others emulate them, thirty times slower. The
    CPU is asked, not timed: on a loaded machine a timing misjudges now and then, and a resumed run
    would go on in another precision.
    """
    if device_type == "cuda":
        return torch.bfloat16
    return torch.bfloat16 if torch.cpu._is_avx512_bf16_supported() else None
