"""Files: read within bounds; written beside and moved into place, all of a set or none.

Every writer of the library goes through `write_set` or `write_file`. It belongs to no room, because motions, plots,
pages, mechanisms and the command line all read and write.
"""

from fivebar_pin._files.reading import MAX_BYTES, as_path, read_bounded
from fivebar_pin._files.writing import check_folder, check_new, write_file, write_set

__all__ = ["MAX_BYTES", "as_path", "check_folder", "check_new", "read_bounded", "write_file", "write_set"]
