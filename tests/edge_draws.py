"""Spellings of matrices and tables as other programs and people write them, and what each may lead to.

LEGAL: the right answer. OPEN: that, or a refusal. MARKED: that, a refusal, or a sentence about it. WRONG: the
file contradicts itself, and only a refusal is right.
"""

import gzip
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

LEGAL, OPEN, MARKED, WRONG = range(4)
OUTCOMES = ({"right"}, {"right", "refused"}, {"right", "refused", "said"}, {"refused"})
Entry = tuple[int, int, float]
#: Legal, open and wrong triangles of a symmetric matrix, beside a contradiction, where both are needed, where
#: one may be enough, where the lower one is meant, and where one of each pair is.
BOTH, ANY = ("both", "", "lower|upper|mixed"), ("both|lower|upper", "mixed", "")
LOWER, ONE = ("lower", "upper|mixed|both", ""), ("lower|upper|mixed", "both", "")
NUMBERS: dict[str, Callable[[float], str]] = {
    "repr": repr,
    "D": lambda value: f"{value:.9E}".replace("E", "D"),
    "no letter": lambda value: f"{value:.9E}".replace("E", ""),
    "no point": lambda value: repr(value).removesuffix(".0"),
    "comma": lambda value: repr(value).replace(".", ","),
}


@dataclass
class Draw:
    """plain : the share of usual spellings. names, kind : of the others. clues : words on what is marked."""

    random: np.random.Generator
    plain: float = 1.0
    kind: int = LEGAL
    names: list[str] = field(default_factory=list)
    clues: list[str] = field(default_factory=list)

    def one(self, what: str, legal: str, open: str = "", marked: str = "", wrong: str = "") -> str:
        """One of the spellings, parted by |, of which the first is the usual one."""
        every = [legal.split("|"), *(words.split("|") if words else [] for words in (open, marked, wrong))]
        kinds = [(word, kind) for kind, words in enumerate(every) for word in words]
        if len(kinds) == 1 or self.random.random() < self.plain:
            return kinds[0][0]
        word, kind = self.pick(kinds[1:])
        self.names.append(f"{what} {word!r}")
        self.kind = max(self.kind, kind)
        return str(word)

    def pick(self, choices: Any) -> Any:
        return choices[int(self.random.integers(len(choices)))]

    def shuffled(self, items: list[Any]) -> list[Any]:
        return [items[k] for k in self.random.permutation(len(items))]


def encoded(draw: Draw, text: str, comment: str = "", gz: bool = False) -> tuple[bytes, str]:
    """Bytes, and what is added to the file's name. comment : its mark. gz : whether packed ones are read."""
    if comment and draw.one("comment", "|foreign"):
        text = f"{comment} Stück, Ø 5 mm\n{text}"
    text = text.rstrip("\n") + draw.one("end", "\n||\n\n| \n")
    text = text.replace("\n", draw.one("line ends", "\n|\r\n|\r"))
    foreign = "" if text.isascii() else "|cp1252"
    wide = "utf-16|utf-16-le|utf-32" + (foreign if comment else "")
    encoding = draw.one("encoding", "utf-8|utf-8-sig" + ("" if comment else foreign), wide)
    content = text.encode(encoding, "replace")
    if draw.one("packed", "|.gz" if gz else "", "" if gz else ".gz"):
        return gzip.compress(content, mtime=0), ".gz"
    return content, ""


def entries(draw: Draw, M: Any, triangles: tuple[str, str, str] | None) -> list[Entry]:
    """Those that a file lists of a matrix, and of a symmetric one as its format has the triangles."""
    side = "both"
    if triangles:
        legal, open, wrong = triangles
        side = draw.one("triangles", legal, open, wrong=f"{wrong}|contradictory".lstrip("|"))
    listed = [(i, j, float(M[i, j])) for i, j in np.argwhere(M).tolist()]
    share = {"lower": 1.0, "upper": 0.0, "mixed": 0.5}.get(side)
    if share is not None:
        below = [(e, draw.random.random() < share) for e in listed if e[0] >= e[1]]
        listed = [(i, j, v) if kept else (j, i, v) for (i, j, v), kept in below]
    if side == "contradictory":
        k = draw.pick([k for k, (i, j, _) in enumerate(listed) if i != j])
        listed[k] = (*listed[k][:2], draw.pick((1.5, -1.0, 0.0)) * listed[k][2])
    how = draw.one("entries", "once|zeros", "twice|halves", wrong="other")
    if how == "zeros" and side != "mixed":
        zeros = [(i, j, 0.0) for i, j in np.argwhere(np.asarray(M) == 0).tolist()]
        listed += [e for e in zeros if share is None or (e[0] > e[1]) == (side == "lower")]
    elif how in ("twice", "halves", "other"):
        k = int(draw.random.integers(len(listed)))
        i, j, value = listed[k]
        listed[k] = (i, j, value / 2 if how == "halves" else value)
        listed.append((i, j, 2 * value if how == "other" else listed[k][2]))
    order = draw.one("order", "rows|columns|shuffled|backwards")
    listed.sort(key=lambda e: e[1::-1] if order == "columns" else e[:2], reverse=order == "backwards")
    return draw.shuffled(listed) if order == "shuffled" else listed


def number(draw: Draw, legal: str = "", open: str = "") -> Callable[[float], str]:
    how = draw.one("numbers", "repr|.16e|.3f|+.16E" + legal, open)
    return NUMBERS.get(how, lambda value: format(value, how))


def matrix_market(draw: Draw, M: Any, symmetric: bool) -> str:
    M = np.asarray(M).reshape(len(M), -1)
    rows, columns = M.shape
    layout = draw.one("layout", "coordinate|array")
    header = draw.one("symmetry", "general|symmetric") if symmetric else "general"
    write, sizes = number(draw, open="D|comma"), f"{rows} {columns}"
    if layout == "array":
        first = [j if header == "symmetric" else 0 for j in range(columns)]
        lines = [write(float(M[i, j])) for j in range(columns) for i in range(first[j], rows)]
    else:
        rule = (LOWER if header == "symmetric" else BOTH) if symmetric else None
        lines = [f"{i + 1} {j + 1} {write(v)}" for i, j, v in entries(draw, M, rule)]
        sizes += f" {len(lines) + int(draw.one('count', '0', wrong='1|-1'))}"
    banner = draw.one("banner", "%%MatrixMarket|%%matrixmarket")
    above = draw.one("header", "|% by hand\n|%\n%é\n")
    return "\n".join([f"{banner} matrix {layout} real {header}\n{above}{sizes}", *lines]) + "\n"


def abaqus(draw: Draw, K: Any, labels: Any) -> str:
    """K by nodes and degrees of freedom, or without labels by rows and columns."""
    between, write = draw.one("between", ",|, |  "), number(draw, open="D")
    rows = [[k] for k in range(1, len(K) + 1)] if labels is None else labels
    names = [between.join(map(str, row)) for row in rows]
    lines = [between.join([names[i], names[j], write(v)]) for i, j, v in entries(draw, K, ANY)]
    return draw.one("header", "|*MATRIX ASSEMBLE\n|** ü\n") + "\n".join(lines) + "\n"


def dmig(draw: Draw, matrices: Mapping[str, Any], labels: Any) -> str:
    """Cards of K, and of A, F and G if there are any, in one of the three widths of fields."""
    width = draw.one("fields", "free|small|large")
    shape = number(draw, "|D|no letter", "no point")
    write = lambda v: min(shape(v), f"{v:.9E}", key=len)  # noqa: E731
    if width == "small":
        write = lambda v: f"{v:.3f}" if abs(v) < 1e6 else f"{v:.1E}"  # noqa: E731
    zero = draw.one("component", "0" if labels[:, 1].any() else "0|")
    points = [[str(node), str(dof or zero)] for node, dof in labels]
    first, text = [[str(k + 1), zero] for k in range(len(points))], ["BEGIN BULK", "$ ü"]
    for name, M in matrices.items():
        M = np.asarray(M).reshape(len(M), -1)
        form = draw.one("form", "6|1") if name[0] == "K" else "9"
        listed = entries(draw, M, {"6": ONE, "1": BOTH}.get(form))
        text.append(_card(width, [name, "0", form, "2", "0", "", "", str(M.shape[1])]))
        split = draw.one("columns", "whole", "in two")
        for j in dict.fromkeys(j for _, j, _ in listed):
            own = [[*(first if name == "G" else points)[i], write(v), ""] for i, k, v in listed if k == j]
            for some in (own[:1], own[1:]) if split == "in two" else (own,):
                at = [name, *(first if form == "9" else points)[j], ""]
                text += [_card(width, [*at, *(word for four in some for word in four)])] if some else []
    return "\n".join([*text, draw.one("last", "ENDDATA|GRID,1,,0.,0.,0.|")]) + "\n"


def _card(width: str, fields: list[str]) -> str:
    count, star, size = (4, "*", 16) if width == "large" else (8, "", 8)
    lines = [fields[k : k + count] for k in range(0, len(fields), count)]
    heads = [f"DMIG{star}", *[star or "+" * (width == "free")] * (len(lines) - 1)]
    if width == "free":
        return "\n".join(",".join([head, *line]) for head, line in zip(heads, lines, strict=True))
    cards = zip(heads, lines, strict=True)
    return "\n".join(f"{head:8}" + "".join(f"{word:{size}}" for word in line) for head, line in cards)


def op4(draw: Draw, matrices: Mapping[str, Any], path: Path) -> None:
    """Written by pyyeti: text or binary, dense or sparse; text then as others write it."""
    from problems.formats.nastran import pyyeti

    writer = pyyeti(path).op4
    names, arrays, forms = [], [], []
    for name, M in matrices.items():
        M = np.asarray(M, dtype=float).reshape(len(M), -1)
        form = int(draw.one("form", "6|1")) if name == "K" else 2
        if name == "K":
            few = ("both|lower|upper", "") if form == 6 else ("both", "lower|upper|")
            side = draw.one("triangles", few[0], wrong=few[1] + "contradictory")
            M = {"lower": np.tril, "upper": np.triu}.get(side, np.array)(M)
            if side == "contradictory":
                i, j = draw.pick(np.argwhere(np.tril(M, -1)))
                M[i, j] *= -1.0
        for factor in draw.one("matrix", "1", "1 1", wrong="1 2").split():
            names, arrays, forms = [*names, name], [*arrays, int(factor) * M], [*forms, form]
    keys: dict[str, Any] = {"sparse": draw.one("storage", "dense|bigmat|nonbigmat"), "forms": forms}
    if draw.one("file", "binary|text") == "binary":
        writer.write(str(path), names, arrays, binary=True, endian=draw.one("endian", "|>"), **keys)
    else:
        writer.write(str(path), names, arrays, binary=False, digits=int(draw.one("digits", "16|9")), **keys)
        letter = draw.one("exponents", "E|D")
        text = path.read_text().replace("E+", f"{letter}+").replace("E-", f"{letter}-")
        path.write_bytes(encoded(draw, text)[0])


def npz(draw: Draw, matrices: Mapping[str, Any], path: Path) -> None:
    arrays = {name: np.asarray(M) for name, M in matrices.items()}
    if draw.one("storage", "dense|sparse") == "sparse":
        K = arrays.pop("K")
        i, j, v = np.array(sorted(entries(draw, K, BOTH), key=lambda e: e[1])).T
        indptr = np.searchsorted(j, np.arange(len(K) + 1))
        arrays |= {"K_data": v, "K_indices": i.astype(int), "K_indptr": indptr, "K_shape": np.array(K.shape)}
    if draw.one("more", "", marked="lb"):
        arrays["lb"] = np.zeros(3)
        draw.clues.append("lb")
    np.savez(path, **arrays)


UNITS = {"[m]": 1e-3, "[µm]": 1e3, "[in]": 1 / 25.4}


def table(
    draw: Draw, columns: Mapping[str, Any], lengths: Any = (), twice: str = "", heads: bool = True
) -> str:
    """A CSV. lengths : columns in mm. twice : the kind of an equal row; without it, rows keep their order.
    heads : whether there are headings.
    """
    commas = "|;,|\t," if len(columns) > 1 else ""  # else nobody can tell ; and , apart
    between, mark = draw.one("cells", f",.|;.|\t.{commas}", ",,| .")
    group = draw.one("thousands", "", "'|\u202f|" + {".": ",", ",": "."}[mark])
    usual = "| [mm]|(mm)|_mm|capitals" + "|units" * bool(twice) if lengths else ""
    style = draw.one("headings", usual, " in mm|/mm|[m]|[µm]|[in]" if lengths else "capitals|units")
    form = draw.one("digits", "|.3f|.7e") or ".3f" * bool(group)

    def cell(name: str, value: Any) -> str:
        if not isinstance(value, float):
            return str(value)
        value *= UNITS.get(style, 1.0) if name in lengths else 1.0
        text = f"{value:{',' * bool(group)}{form}}" if form and style not in UNITS else repr(value)
        return text.translate(str.maketrans({",": group, ".": mark}))

    added = style * (style not in ("capitals", "units"))
    head = [[name + added * (name in lengths) for name in columns]]
    if style == "capitals":
        head = [[name.upper() for name in columns]]
    elif style == "units":
        head.append(["mm" if name in lengths else "" for name in columns])
    rows = zip(*columns.values(), strict=True)
    body = [[cell(name, value) for name, value in zip(columns, row, strict=True)] for row in rows]
    if twice:
        if draw.one("row", "once", **{twice: "twice"}) == "twice":
            body.append(list(draw.pick(body)))
            draw.clues += ["twice", "listed", "same"]
        order = draw.one("order of rows", "|shuffled|backwards")
        body = draw.shuffled(body) if order == "shuffled" else body[:: -1 if order else 1]
    names = "|unnamed|Nr" * heads + "|name|remark" * bool(lengths)
    rare = "#|not in the heading" + "|name" * (not lengths) + "|unnamed" * (not heads)
    index = draw.one("index", names, rare)
    for k, line in enumerate(body):
        if index == "remark":
            line.append('"left, Ä"')
        elif index:
            line.insert(
                0, f"{draw.pick('P#')}{k}" if index == "#" else f"P{k}" if index == "name" else str(k)
            )
    for k, line in enumerate(head if index != "not in the heading" else []):
        title = "" if k or index == "unnamed" else index.replace("#", "name")
        if index:
            line.insert(len(line) if index == "remark" else 0, title)
    if lengths and index not in ("", "unnamed", "not in the heading") and draw.one("columns", "|turned"):
        head, body = [line[::-1] for line in head], [line[::-1] for line in body]
    end = draw.one("trailing", "|rows|all", "heading")
    above = [between.join(line) + between * (end in ("all", "heading")) for line in head if heads]
    text = above + [between.join(line) + between * (end in ("all", "rows")) for line in body]
    more = draw.one(
        "lines", "|blank|separators", "# first|sep=|title" + "|sum" * bool(lengths) + "|no heading" * heads
    )
    match more:
        case "blank" | "separators":
            text.insert(len(text) - 1, between * len(body[0]) * (more == "separators"))
        case "# first" | "sep=" | "title":
            titles = {"# first": "# exported today", "sep=": f"sep={between}"}
            text.insert(0, titles.get(more, "Inspection report 7"))
        case "sum":
            text.append(f"mean{between * (len(body[0]) - 1)}0.25")
        case "no heading":
            text = text[len(above) :]
    return "\n".join(text) + "\n"
