"""Sample logs, written by `python -m tests.sample_logs`."""
