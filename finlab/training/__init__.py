"""Training: the loop, and weights to start from, with PyTorch; `finlab.mdn.training` says what is learned."""
