"""What the tests of the analysis share: the robots of the tests of forces."""

from tests.forces.conftest import shipped as shipped
from tests.forces.conftest import wide as wide
