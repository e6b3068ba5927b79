"""Make the folders of outputs that templates name, and take those away again that stay empty."""

from contextlib import suppress
from pathlib import Path
from types import TracebackType

from dmc_cli.app.label_files import is_template
from dmc_cli.files import write_error
from dmc_cli.settings import STREAM, ConvertSettings, LabelSettings


class OutputFolders:
    """Folders that are made for several conversions, by one thread or by several.

    They are a context: at its end, when no conversion is at work, those that are empty go.
    """

    def __init__(self) -> None:
        self._made: list[Path] = []

    def make(self, item: ConvertSettings | LabelSettings) -> None:
        """Make the folders of the outputs of an item that are not there; a label's own come with its file.

        Raises:
            WriteError: One cannot be made.
        """
        output = item.output
        for path in (output.path, output.halfedges, output.report, output.marked):
            if path is not None and not (isinstance(item, LabelSettings) and is_template(path)):
                self.make_for(path)

    def make_for(self, path: str) -> None:
        """Make the folder of an output if it is not there.

        Raises:
            WriteError: It cannot be made.
        """
        if path == STREAM:
            return
        folder = Path(path).parent
        missing = [part for part in (folder, *folder.parents) if not part.exists()]
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise write_error(path, error) from error
        self._made += missing

    def __enter__(self) -> "OutputFolders":
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove what was made and is empty, deepest first."""
        for folder in sorted(set(self._made), key=lambda path: len(path.parts), reverse=True):
            with suppress(OSError):  # something is in it
                folder.rmdir()
