"""Expressions and parameters of LS-DYNA keyword decks give the values of the rules of the manual.

The rules and their examples are those of the LS-DYNA Keyword User's Manual I, *PARAMETER_EXPRESSION, remarks 1 to 3.
"""

import math
import random
from pathlib import Path

import pytest

from conoid.cases.reading.cards import CardError, Deck
from conoid.cases.reading.expressions import evaluate

VALUES: dict[str, int | float | str] = {"term": 0.2, "states": 80, "name": "bar"}
RULES = {
    "2/5": 0, "2.0/5": 0.4, "-7/2": -3, "7/-2": -3, "-3**2": 9, "2**3**2": 512, "mod(7.6, 3)": 2, "mod(-7,2)": -1,
    "sign(-4,8)": 4, "sign(4.0, -8)": -4.0, "int(-48.1)": -48, "int(0.9)": 0, "nint(2.5)": 3, "nint(-2.5)": -3,
    "aint(2.7)": 2.0, "anint(2.5)": 3.0, "term/(states-30)": 0.004, "&term * 2": 0.4, "max(1, 2.5)": 2.5,
    "min(3,1,2)": 1, "1.5d-3": 1.5e-3, "PI": math.pi, "90*dtor": math.pi / 2, "sec(0)": 1.0, "abs(-3)": 3, "--2": 2,
    "float(7)/2": 3.5, "2.0**-1": 0.5, "atan2(1,-1)": 3 * math.pi / 4, "1.-.5": 0.5, "3 - -2": 5,
}  # fmt: skip


@pytest.mark.parametrize("text", RULES)
def test_an_expression_has_the_value_of_the_rules(text: str) -> None:
    found = evaluate(text, VALUES)
    assert found == pytest.approx(RULES[text], rel=1e-15)
    assert type(found) is type(RULES[text])


WRONG = {
    "": "expected at the end", "1+": "expected at the end", "(1": "not closed", "1 2": "'2' is behind the end",
    "foo": "'foo' is not defined above; known: term, states, name", "foo(1)": "'foo' is no function",
    "name+1": "'bar', which is no number", "sqrt(-1)": "sqrt has no value at -1", "1/0": "division by 0",
    "1.0/0": "division by 0", "mod(1,0)": "mod has no value", "10**40": "too large", "exp(1e3)": "too large",
    "9" * 30: "too large", "2**-1": r"write 2\.0\*\*-1", "(-8.0)**0.5": "has no value", "atan2(1)": "1 arguments",
    "__import__('os')": "is no function", "().__class__": "expected at", "lambda: 1": "not defined",
    "(" * 100: "more than 40 brackets", "-" * 3000: "more than 2000 characters", "1" + "**1" * 600: None,
    "1e400": "too large", "a.b": "not defined", "2**2**2**2**2": "too large", "x:=1": "not defined", "1;2": "behind",
}  # fmt: skip


@pytest.mark.parametrize("text", WRONG, ids=lambda text: text[:20])
def test_what_is_no_expression_is_refused_in_one_line(text: str) -> None:
    message = WRONG[text]
    if message is None:
        assert evaluate(text, VALUES) == 1
        return
    with pytest.raises(ValueError, match=message) as raised:
        evaluate(text, VALUES)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 500


def test_expressions_made_at_random_equal_those_of_python() -> None:
    dice = random.Random(5)

    def made(depth: int) -> str:
        if depth == 0:
            return f"{dice.uniform(0.1, 9):.3f}"
        one, other = made(depth - dice.randrange(1, depth + 1)), made(depth - 1)
        return dice.choice(
            (f"({one}+{other})", f"{one}*{other}", f"({one} - {other})", f"({one})/({other})", f"math.cos({one})")
        )

    for _ in range(300):
        text = made(4)
        try:
            wanted = eval(text)
        except ZeroDivisionError:
            continue
        assert evaluate(text.replace("math.", ""), {}) == pytest.approx(wanted, rel=1e-15)


def fields(folder: Path, text: str) -> list[list[str]]:
    (folder / "a.k").write_text(f"*KEYWORD\n{text}*END\n")
    return [
        block.fields(card, *(10,) * 8)
        for block in Deck(folder / "a.k").blocks() if block.name == "MAT_ELASTIC"
        for card in block.filled()
    ]  # fmt: skip


DECK = """*PARAMETER_MUTABLE
R rho     7.85E-9   I n              4
rlong,12.5
*PARAMETER_TYPE
I part           7  PART
*PARAMETER_EXPRESSION
Rvol      4.0/3.0*pi*
          &long**3
I half    &n/3
rplot,max(long,n)/2
C text    /some/where
*PARAMETER_LOCAL
Rlocal    -2.5-3
*MAT_ELASTIC
      &rho      &n     &half     &vol   -&local
<plot*2>,&part,&plot/4.,-&half
"""


def test_parameters_and_expressions_are_inserted_into_fields(tmp_path: Path) -> None:
    first, second = fields(tmp_path, DECK)
    assert first[:5] == ["7.85e-09", "4", "1", repr(4.0 / 3.0 * math.pi * 12.5**3), "0.0025"]
    assert second[:4] == ["12.5", "7", "1.5625", "-1"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("*PARAMETER\nRx             abc\n", "line 3: the parameter 'x' = 'abc' is not a number"),
        ("*PARAMETER\nRx               1\n*PARAMETER_LOCAL\nRx 2,2\n", "line 5: 'Rx 2' with the value '2' defines no"),
        ("*PARAMETER\nRx               1\n*PARAMETER_LOCAL\nRx               2\n", "line 5: .*'x' has another value"),
        ("*PARAMETER\nIx             2.5\n", "'x' = 2.5 of the type I is not a whole number; use int or nint"),
        ("*PARAMETER_EXPRESSION\nRx        1+y\n", "line 3: the parameter 'y' is not defined above; known: none"),
        ("*PARAMETER_EXPRESSION\nRx        1+\n          +y)\n", "line 3: the parameter 'y' is not defined above"),
        ("*PARAMETER_EXPRESSION\nx         1\n", "line 3: 'x' with the value '1' defines no parameter"),
        ("*MAT_ELASTIC\n&x+1\n", r"line 3: '&x\+1': the parameter 'x' is not defined above"),
        ("*PARAMETER_OTHER\nRx               1\n", r"\*PARAMETER_OTHER is not supported"),
    ],
)
def test_a_wrong_parameter_is_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(CardError, match=message):
        fields(tmp_path, text)
