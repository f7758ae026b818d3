"""Files that may come from a stranger: opened in one way, unpacked within limits, read as plain values."""
