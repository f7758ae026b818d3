"""A benchmark that others can run: problems in a file, a runner for any method, metrics and a table."""
