"""The sections of the report, one per file, found by discovery.

To add one, write a file with

    PLACE = Place(345)                                      # where it stands, and what it is about
    def section(results: Results) -> Section | None: ...    # None if the results have nothing for it
"""
