"""What each actuator can push, as a convex set, and how that adds up. numpy and scipy."""
