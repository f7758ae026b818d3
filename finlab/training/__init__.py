"""Training: the loop, its state and its device. It needs PyTorch, as does `finlab.mdn.training`,
which says what is learned."""
