"""Sampling, features and normalization of training data."""
