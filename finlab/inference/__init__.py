"""What a trained network needs in order to answer: features, networks and weights. numpy only."""
