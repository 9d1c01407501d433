"""Files of data become records: tables, times, columns, segments, and what was done to them."""

from inputdesign_cli.records.reading import read_sheet as read_sheet
from inputdesign_cli.records.record import (
    Record as Record,
    read_data as read_data,
    read_log as read_log,
    read_logs as read_logs,
)
from inputdesign_cli.records.sheet import Preparation as Preparation, Run as Run, Sheet as Sheet
