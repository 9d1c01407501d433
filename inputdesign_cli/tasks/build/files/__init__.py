"""Files of data as they come, each kind in a file of its own, all as one `Sheet`."""

from inputdesign_cli.tasks.build.files.reading import read_sheet as read_sheet
from inputdesign_cli.tasks.build.files.sheet import Sheet as Sheet
