"""Least-power allocation by one dual: every actuator answers a price."""
