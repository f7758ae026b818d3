"""Networks that learn what actuators do to each other: drawn samples and training. They need
torch."""
