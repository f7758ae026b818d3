"""The robot's side: the bundle (layout graph, the fins' physics, settings) and the runtime."""
