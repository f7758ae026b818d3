"""How values show themselves: as text, as HTML in notebooks, and as pictures by matplotlib (extra `plot`)."""
