"""The exit codes of the commands, as README and help texts state them.

FAILED: the command ran, but accuracy was lost, a solver has faults, or measurements are missing.
"""

DONE, FAILED, WRONG_USAGE, NOTHING_JUDGED, INTERRUPTED = 0, 1, 2, 3, 130
