"""What trained networks share: their layers, their weights on disk, and the yardsticks of their numbers."""
