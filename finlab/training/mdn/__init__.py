"""Training of method `mdn`: random fins, exact answers of the search as a teacher, a mixture over forces."""
