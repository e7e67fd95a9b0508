"""Pages on disk: Markdown, pictures, CSV, VTU."""
