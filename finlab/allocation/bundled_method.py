"""The method that a bundle's robot answers with, from what the bundle's files say."""

from finlab.allocation.methods import METHODS_ON_BOARD, MethodChoice, checked_settings, method_class
from finlab.bundle_files import CHECKPOINT_FOLDER, FORMAT, MANIFEST_FILE, Files
from finlab.errors import AllocationError, DataError
from finlab.files import parse_json
from finlab.files.guarded import decoded


def bundled_method(files: Files, source: str) -> MethodChoice:
    """Reads which method a bundle's robot answers with.

    Args:
        files: of the bundle, by name.
        source: what errors call the bundle, such as its path.

    Returns:
        The method, with the networks and settings that the files hold.

    Raises:
        CheckpointError: its networks are damaged, or it has none and this finlab has not those that
            it names.
        DataError: the bundle is of another format, has a method that runs on no robot, or settings
            that no robot should try.
    """
    where = f"{source}/{MANIFEST_FILE}"
    document = parse_json(decoded(files[MANIFEST_FILE], where, "JSON"), where)
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise DataError(f"{where}: expected format {FORMAT}; a bundle is made by `finlab export`")
    method = document.get("method")
    checkpoint = document.get("checkpoint")
    values = document.get("settings")
    if not isinstance(method, str) or method not in METHODS_ON_BOARD:
        known = ", ".join(METHODS_ON_BOARD)
        raise DataError(f"{where}: method must be one of {known}, got {method!r:.40}")
    if not isinstance(checkpoint, str | None) or not isinstance(values, dict):
        raise DataError(f"{where}: checkpoint must be a name and settings must be keys and values")
    kind = method_class(method)
    try:
        settings = checked_settings(kind, values)
    except AllocationError as error:
        raise DataError(f"{where}: settings: {error}") from None
    network_files = {
        path.removeprefix(CHECKPOINT_FOLDER): content
        for path, content in files.items()
        if path.startswith(CHECKPOINT_FOLDER)
    }
    networks = kind.networks_in(
        network_files, f"{source}/{CHECKPOINT_FOLDER.rstrip('/')}", checkpoint
    )
    return MethodChoice(kind, settings, networks)
