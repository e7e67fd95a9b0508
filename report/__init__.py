"""Reports from results: Markdown, pictures, CSV, pages in HTML, sheets in PDF; reads nothing else."""
