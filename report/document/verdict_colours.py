"""The colours of PASS and FAIL: on the console, on pages, in pictures and on sheets."""

PASS, FAIL = "#009E73", "#D0112B"
COLOURS = {"pass": PASS, "fail": FAIL, "": "#1C2126"}
