"""A robot from a swim: what its fins, its body and its water really are, and what a layout then
says."""
