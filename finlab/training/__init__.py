"""Training: the loop and its state. It needs PyTorch, as does `finlab.mdn.training`,
which says what is learned."""
