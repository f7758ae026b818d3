"""The default method: an exact search for the cheapest allocation, on the fins' own laws."""
