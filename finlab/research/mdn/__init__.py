"""Method `mdn`: a mixture density network proposes ways to deliver a wrench, refinement makes them
exact."""
