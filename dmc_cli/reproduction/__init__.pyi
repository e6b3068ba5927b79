# What other folders use of this one; `__init__.py` says what it is for.

from .reproduce import rows_as_json as rows_as_json, rows_as_text as rows_as_text
from .reproduce_run import reproduce_tables as reproduce_tables
from .spreads import Spreads as Spreads, drawn_data as drawn_data, gather_spreads as gather_spreads
