"""What a user's hand does in the 3D view."""

from webapp.session import Session

Vector = tuple[float, float, float]


def move_fin(session: Session, name: str, position: Vector) -> None:
    """Drag a fin to a place [m] and let it go."""
    fin = session.state.layout.fins[session.state.layout.index(name)]
    session.end_drag(name, position, fin.mounting_angle)


def turn_fin(session: Session, name: str, angle: float) -> None:
    """Turn a fin's ring to an angle [rad] and let it go."""
    fin = session.state.layout.fins[session.state.layout.index(name)]
    session.end_drag(name, fin.position, angle)
