"""The interactive page: one HTML file that needs no network, made from the same data as the report."""
