"""The exit codes of the commands, as README and helps state them.

FELL_SHORT: the command ran, and what it is to see to is not so: accuracy was lost, a solver has faults,
measurements are missing.
"""

DONE, FELL_SHORT, WRONG_USAGE, NOTHING_JUDGED, INTERRUPTED = 0, 1, 2, 3, 130
