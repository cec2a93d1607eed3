"""``python -m clarke_gym`` says what is there, and notices what is broken."""

import re

import numpy as np

from clarke_gym import __main__ as self_check


def test_all_is_well(capsys):
    assert self_check.main() == 0
    first, *lines = capsys.readouterr().out.splitlines()
    assert re.match(r"clarke_gym \d+\.\d+\.\d+, Python 3\.\d+\.\d+, gymnasium 1\.", first)
    assert len(lines) == 5
    assert all(" ok: " in line for line in lines[:4])
    assert re.search(r" (ok: drawn|missing: no OpenGL)", lines[4])


def test_what_is_broken_is_said(capsys, monkeypatch):
    monkeypatch.setattr(self_check.clarke, "from_clarke", lambda pair, n: np.ones(n))
    assert self_check.main() == 1
    assert "FAILED: there and back differs by" in capsys.readouterr().out


def test_missing_pictures_are_no_failure(capsys, monkeypatch):
    def no_picture():
        raise RuntimeError("no OpenGL")

    monkeypatch.setattr(self_check, "CHECKS", (("pictures", no_picture),))
    assert self_check.main() == 0
    assert "missing: no OpenGL" in capsys.readouterr().out
