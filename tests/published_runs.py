"""The directories of published runs."""

from studies.publish import PUBLISHED

DIRECTORIES = sorted(path.parent for path in PUBLISHED.glob("*/measurements.jsonl"))
