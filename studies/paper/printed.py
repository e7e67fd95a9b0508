"""What the paper prints: the numbers of its Tables 1, 2 and 4, and the orders of its Table 3.

Source: Stefanova, Yakunin, Petukhova, Lupuleac, Kokkolaras, An interior-point method-based solver for
simulation of aircraft parts riveting, Les Cahiers du GERAD G-2017-62 (Engineering Optimization, 2017),
doi 10.1080/0305215X.2017.1355367. Times: seconds on an Intel Core i5, 3.30 GHz, 16 GB.
"""

from __future__ import annotations

#: Table 1, section 5.3, n = 4386: CG iterations of each outer iteration. Which load, ordering, CG
#: tolerance and ε_μ: not stated.
TABLE_1 = {
    "V = I": {
        "predictor": [
            *(18395, 32527, 28273, 20770, 15354, 8234, 3919, 1610, 579, 183, 118, 89, 71, 58, 49, 42, 36, 29),
            *(25, 30, 54, 102, 188, 318, 370, 546, 595, 532, 940, 1962, 2540, 3607, 6092, 6406, 18079, 26399),
        ],
        "corrector": [
            *(19636, 33338, 28405, 21127, 15449, 8250, 3893, 1562, 545, 168, 107, 81, 64, 52, 44, 37, 32, 26),
            *(21, 25, 43, 96, 165, 226, 233, 89, 211, 109, 242, 549, 407, 1850, 3169, 3690, 3189, 3987),
        ],
    },
    "V = U + √D": {
        "predictor": [
            *(20, 17, 17, 17, 17, 17, 17, 17, 17, 16, 15, 14, 13, 13, 12, 11, 11, 11, 11, 11, 14, 15),
            *(17, 17, 15, 14, 14, 14, 14, 17, 19, 17, 23, 23),
        ],
        "corrector": [
            *(22, 18, 18, 18, 18, 17, 17, 17, 16, 15, 14, 14, 13, 12, 11, 11, 10, 10, 9, 10, 11, 13),
            *(14, 13, 11, 13, 13, 13, 13, 10, 12, 10, 9, 9),
        ],
    },
}  # fmt: skip

#: Table 2, section 5.4, n = 4386: by the number of active constraints, for STP1, STP2 and Algorithm 5
#: (iterations, seconds).
TABLE_2 = {
    52: {"stp1": (24, 45.117), "stp2": (26, 50.036), "algorithm_5": (25, 47.323)},
    107: {"stp1": (24, 73.511), "stp2": (24, 72.134), "algorithm_5": (25, 74.857)},
    418: {"stp1": (24, 119.645), "stp2": (24, 121.226), "algorithm_5": (24, 121.673)},
    795: {"stp1": (24, 109.433), "stp2": (22, 104.378), "algorithm_5": (22, 101.324)},
    863: {"stp1": (23, 98.536), "stp2": (22, 101.202), "algorithm_5": (21, 89.793)},
    1074: {"stp1": (23, 88.546), "stp2": (22, 89.891), "algorithm_5": (21, 82.979)},
    1128: {"stp1": (24, 85.498), "stp2": (21, 81.601), "algorithm_5": (21, 78.217)},
    1347: {"stp1": (25, 75.866), "stp2": (21, 71.506), "algorithm_5": (20, 64.038)},
    1471: {"stp1": (24, 69.343), "stp2": (21, 66.267), "algorithm_5": (21, 64.558)},
    1592: {"stp1": (24, 64.895), "stp2": (24, 71.203), "algorithm_5": (21, 59.902)},
}

#: Table 4, section 6: the problem's number, n, m and cond(K).
TABLE_4 = [(1, 4386, 2193, 2.63e6), (2, 6112, 3056, 1.11e7), (3, 11308, 5654, 1.77e7)]
