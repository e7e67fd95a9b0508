"""The output of commands in a terminal, and their exit codes, as docs/commands.md and help texts state them.

FAILED: the command ran, but accuracy was lost, a solver has faults, or measurements are missing.
GAP_EXCEEDED: the answer is good, and the gap that it leaves is larger than allowed.
READER_GONE: of a pipe, as `| head` leaves it: 128 + SIGPIPE.
NOT_COMPARABLE: each input is sound, but they do not belong together (harness/results/comparison.py).
"""

DONE, FAILED, WRONG_USAGE, NOTHING_JUDGED = 0, 1, 2, 3
GAP_EXCEEDED, NOT_COMPARABLE, INTERRUPTED, READER_GONE = 4, 5, 130, 141
