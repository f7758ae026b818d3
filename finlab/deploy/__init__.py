"""Software on a robot: the bundle and `finlab-runtime`, and the allocator as C sources."""
