"""What a user's hand does in the 3D view."""

from webapp.session import Session

Vector = tuple[float, float, float]


def move_fin(session: Session, name: str, position: Vector) -> None:
    """Drag a fin to a place [m] and let it go."""
    session.end_drag(name, position)


def turn_fin(session: Session, name: str, angle: float) -> None:
    """Select a fin and turn it to an angle [rad]."""
    session.select(name)
    session.turn_selected(angle)
