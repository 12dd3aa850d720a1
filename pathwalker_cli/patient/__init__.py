"""What is known about one patient: the file, its numbers, and what may differ from it."""

from pathwalker_cli.patient.blocks import OrthosisData as OrthosisData
from pathwalker_cli.patient.file import JENSEN_AGES as JENSEN_AGES
from pathwalker_cli.patient.file import Patient as Patient
from pathwalker_cli.patient.file import load_patient as load_patient
from pathwalker_cli.patient.file import recordings_beside as recordings_beside
from pathwalker_cli.patient.file import shipped_patients as shipped_patients
