"""Tables for papers: LaTeX with booktabs."""

from __future__ import annotations

from agents.reporting.tables import Rows

_LETTERS = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "\u2212": "$-$",
    "\u00d7": r"$\times$",
    "\u2013": "--",
    "\u2265": r"$\geq$",
    "\u2264": r"$\leq$",
    "\u221e": r"$\infty$",
    "<": "$<$",
    ">": "$>$",
    **{letter: f"\\{letter}" for letter in "&%$#_{}"},
}


def escaped(text: str) -> str:
    r"""Return a text that LaTeX sets as it is.

    Examples
    --------
    >>> print(escaped("raw_scaled & \\input{x}"))
    raw\_scaled \& \textbackslash{}input\{x\}
    """
    return "".join(_LETTERS.get(letter, letter) for letter in " ".join(text.split()))


def latex(rows: Rows) -> str:
    r"""Lay rows out as a ``tabular`` with the rules of booktabs.

    Examples
    --------
    >>> print(latex([["arm", "AUC"], ["raw", "\u22120.1"]]))
    \begin{tabular}{ll}
    \toprule
    arm & AUC \\
    \midrule
    raw & $-$0.1 \\
    \bottomrule
    \end{tabular}
    """
    lines = [" & ".join(map(escaped, row)) + r" \\" for row in rows]
    # What begins with a bracket or a star would be an argument of the line break before it.
    heading, *body = [f"{{}}{line}" if line[:1] in ("[", "*") else line for line in lines]
    columns = "l" * len(rows[0])
    return "\n".join(
        [
            rf"\begin{{tabular}}{{{columns}}}",
            r"\toprule",
            heading,
            r"\midrule",
            *body,
            r"\bottomrule",
            r"\end{tabular}",
        ]
    )
