"""Records of runs, and what is computed from them: errors, means, intervals, tables. Numpy only."""
