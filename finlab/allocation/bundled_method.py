"""The method that a bundle's robot answers with, from what the bundle's files say."""

from finlab.allocation.methods import METHODS_ON_BOARD, MethodChoice, checked_settings, method_class
from finlab.bundle_files import ABOUT, FORMAT, NETWORKS, Files
from finlab.errors import AllocationError, DataError
from finlab.files import parse_json
from finlab.files.guarded import decoded


def bundled_method(files: Files, source: str) -> MethodChoice:
    """The method of a bundle with what its files hold. Raises CheckpointError: its networks are
    damaged, or it has none and this finlab has not those that it names; DataError: the bundle is of
    another format, has a method that runs on no robot, or settings that no robot should try."""
    place = f"{source}/{ABOUT}"
    document = parse_json(decoded(files[ABOUT], place, "JSON"), place)
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{place}: expected format {FORMAT}; a bundle is made by `finlab export`")
    method, checkpoint, values = (document.get(key) for key in ("method", "checkpoint", "settings"))
    if not isinstance(method, str) or method not in METHODS_ON_BOARD:
        known = ", ".join(METHODS_ON_BOARD)
        raise DataError(f"{place}: method must be one of {known}, got {method!r:.40}")
    if not isinstance(checkpoint, str | None) or not isinstance(values, dict):
        raise DataError(f"{place}: checkpoint must be a name and settings must be keys and values")
    kind = method_class(method)
    try:
        settings = checked_settings(kind, values)
    except AllocationError as error:
        raise DataError(f"{place}: settings: {error}") from None
    inside = {
        key.removeprefix(NETWORKS): part for key, part in files.items() if key.startswith(NETWORKS)
    }
    networks = kind.networks_in(inside, f"{source}/{NETWORKS.rstrip('/')}", checkpoint)
    return MethodChoice(kind, settings, networks)
