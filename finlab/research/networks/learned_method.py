"""Base of the allocation methods that ask trained networks: where these are read, and what they
know."""

import hashlib
import os
from collections.abc import Mapping
from typing import ClassVar

from finlab.actuators.fin.fin_model import FinModelSpec
from finlab.allocation.method import Checkpoint, Method, Networks
from finlab.assets import checkpoint_path, shipped_checkpoints
from finlab.errors import CheckpointError
from finlab.files.checkpoint_config import WEIGHTS_FILE
from finlab.research.networks.checkpoint import (
    checkpoint_files,
    parse_checkpoint,
    read_checkpoint,
    resolve_checkpoint,
)
from finlab.research.networks.trained import TrainedWeights


class LearnedMethod(Method):
    """A method with trained networks."""

    needs_networks = True
    networks: TrainedWeights
    shipped_checkpoint: ClassVar[str] = "default"
    """Name of the shipped checkpoint that holds its networks."""
    fin_model: FinModelSpec | None = None
    """Fin model that the networks have learned; None for methods that ask every fin's own model."""

    @classmethod
    def read_networks(cls, checkpoint: Checkpoint) -> TrainedWeights:
        """Returns the networks of a checkpoint.

        Args:
            checkpoint: a checkpoint folder, the name of a shipped checkpoint, or its contents; None
                for the one that is shipped for the method.

        Raises:
            CheckpointError: it is missing, corrupt or foreign.
        """
        if isinstance(checkpoint, TrainedWeights):
            return checkpoint
        if checkpoint is None or isinstance(checkpoint, str | os.PathLike):
            return read_checkpoint(resolve_checkpoint(checkpoint or cls.shipped_checkpoint))
        raise CheckpointError(
            f"checkpoint: expected its folder, name or contents, got {checkpoint!r:.60}"
        )

    @classmethod
    def networks_in(
        cls, files: Mapping[str, bytes], source: str, name: str | None
    ) -> TrainedWeights:
        """Returns the networks of a robot's bundle.

        Args:
            files: files of their checkpoint, by name; none where they come with finlab.
            source: what errors call the checkpoint.
            name: of the checkpoint; None for the one that is shipped for the method.

        Raises:
            CheckpointError: they are damaged, or there are none and this finlab has not those of
            that name.
        """
        known = name or cls.shipped_checkpoint
        if files:
            return parse_checkpoint(files, source, known)
        return read_checkpoint(checkpoint_path(known))

    @classmethod
    def networks_for_bundle(cls, networks: Networks | None) -> tuple[str | None, dict[str, bytes]]:
        """Returns the SHA-256 of the networks' weights, and by name the files of those that do not
        come with finlab."""
        if networks is None:  # a method that was made without its own
            return None, {}
        assert isinstance(networks, TrainedWeights)
        shipped = shipped_checkpoints().get(networks.name)
        if shipped is not None and read_checkpoint(shipped).sha256 == networks.sha256:
            return networks.sha256, {}
        files = checkpoint_files(networks)
        return hashlib.sha256(files[WEIGHTS_FILE]).hexdigest(), files

    @property
    def unknown_fins(self) -> tuple[str, ...]:
        """Names of the fins whose model the networks have not learned; answers for them are
        wrong."""
        if self.fin_model is None:
            return ()
        known = self.fin_model.type, self.fin_model.values()
        models = ((part.name, part.value("model")) for part in self.layout.actuators)
        return tuple(name for name, model in models if (model.type, model.values()) != known)

    @property
    def notes(self) -> tuple[str, ...]:
        """The sentence about fins that the networks do not know."""
        model = self.fin_model
        if model is None or not self.unknown_fins:
            return ()
        values = [
            f"{k} {v:g}" if isinstance(v, float) else f"{k} {v}" for k, v in model.values().items()
        ]
        return (
            f"the method does not know these fins: {', '.join(self.unknown_fins)}; checkpoint "
            f"{self.networks.name!r} takes them for fins of model {model.type!r} "
            f"({', '.join(values)}): trust the plant's error or train a surrogate for them",
        )
