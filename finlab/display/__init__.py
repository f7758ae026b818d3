"""Values as text, as HTML in notebooks and pictures by matplotlib (extra `plot`)."""
