"""The report's pictures: records or rows in, SVG out. matplotlib lives here."""
