"""The paper in one room: features, network, surrogate, pipeline, training."""
