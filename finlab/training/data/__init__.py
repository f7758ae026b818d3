"""Training data: seeded sampling and what is kept out of it."""
