"""Method `mdn`: a mixture density network proposes ways to deliver a wrench, a search makes them exact."""
