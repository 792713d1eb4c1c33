"""Where the platform is at every sample: as document, table, picture and file."""

from cdprcal.tracking.document import columns_of_track as columns_of_track
from cdprcal.tracking.document import save_track as save_track
from cdprcal.tracking.document import track_as_dict as track_as_dict
