"""HTML that the panels show. Plain functions from values to text; every name from outside is
escaped here."""
