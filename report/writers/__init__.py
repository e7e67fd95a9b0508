"""Files on disk: Markdown, pictures, CSV, VTU, pages in HTML, sheets in PDF."""
