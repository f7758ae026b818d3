"""Training: the loop, its state and its device. It needs PyTorch, as do `finlab.paper.training` and
`finlab.mdn.training`, which say what is learned."""
