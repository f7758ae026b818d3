"""What a robot runs: the bundle and `finlab-runtime`, and the allocator as C sources."""
