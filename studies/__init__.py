"""Programs that a maintainer runs on published results; no part of the installed packages."""
