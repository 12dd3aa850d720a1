"""What is known about one patient: the file, its numbers, and what may differ from it."""

from pathwalker_cli.patient.file import (
    JENSEN_AGES,
    ContactPoints,
    FootPoints,
    OrthosisData,
    Patient,
    Recorded,
    SegmentLengths,
    Strengths,
    load_patient,
    recordings_beside,
    shipped_patients,
)

__all__ = [
    "JENSEN_AGES",
    "ContactPoints",
    "FootPoints",
    "OrthosisData",
    "Patient",
    "Recorded",
    "SegmentLengths",
    "Strengths",
    "load_patient",
    "recordings_beside",
    "shipped_patients",
]
