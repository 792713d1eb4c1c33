"""What the model lacks, as plain data and as pictures."""

from cdprcal.diagnosis.document import diagnosis_as_dict

__all__ = ["diagnosis_as_dict"]
