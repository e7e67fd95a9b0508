"""The same bounds for many load cases at a time."""
