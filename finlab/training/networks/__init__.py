"""Networks only: they see tensors, never a layout."""
