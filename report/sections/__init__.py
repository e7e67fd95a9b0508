"""The sections of the report, one a file: `section(results) -> Section | None`."""
