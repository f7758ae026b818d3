"""Training data: seeded sampling, shards on disk, features and normalization."""
