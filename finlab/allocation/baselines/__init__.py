"""The methods that know the fins' own laws and need no training."""
