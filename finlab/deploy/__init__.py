"""What a robot takes home: the layout graph, the bundle with its networks, and the runtime that answers."""
