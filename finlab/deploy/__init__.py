"""What the robot runs: the bundle (layout graph, the fins' physics, settings) and the runtime."""
