"""``python -m cdprcal.hardware.session``: prints the JSON schema of session files."""

import sys

from cdprcal.hardware.session.file import schema_text

sys.stdout.write(schema_text())
