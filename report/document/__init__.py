"""What a page consists of: sections, tables, figures, numbers."""
