"""What a robot takes home: layout graph and bundle with the fins' physics, and the runtime that answers."""
