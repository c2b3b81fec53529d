"""Pictures and charts of a report, embedded in the page."""

import io
import re
import tempfile
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import Any

from conoid.cases.figures import exacts
from conoid.cases.messages import Load

from ..drawing.fields import FIELDS
from ..drawing.picture import Drawn
from ..errors import ClientError, UnfinishedError, ViewError
from ..result import Result
from . import html

_SHOTS = 3
"""Number of frames in which a field is drawn, evenly spaced over the run. Chosen value: three pictures fit side by
side."""
_SIZE = (1300, 745)
_CHART, _LETTERS = (4.6, 3.0), 9
"""Size of each chart, inches, and of its texts, points. Chosen values: on a card of 400 px a text has 11 px."""
_INK, _FAINT = "#1d2733", "#b5bcc4"
"""Colours of text and faint lines in charts. A report replaces these colours by its own text colours, so that a
chart is readable on a light and on a dark background."""


def pictures(result: Result, fields: Sequence[str], at: Callable[[str], None]) -> str:
    """Draws each field at several times, and the last state of one field on a section. If a picture fails, a text
    line with the error replaces it.
    """
    frames = [frame.index for frame in result.frames]
    if not frames or not fields:
        return ""
    some = sorted({frames[round((len(frames) - 1) * (k + 1) / _SHOTS)] for k in range(_SHOTS)})
    drawn = []
    for field in fields:
        at(f"drawing {field} at {len(some)} times")
        drawn.append(_picture(result, field, f"at {len(some)} times", frame=some, mirror="auto"))
    inside = next((field for field in fields if FIELDS[field].kind not in ("classes", "fragments")), "")
    if inside:
        at(f"drawing {inside} on a section")
        drawn.append(_picture(result, inside, "on a cut", frame=[frames[-1]], **_cut(result)))
    return "".join(drawn)


def _cut(result: Result) -> dict[str, str]:
    """Returns the options of a picture that shows the inside of the bodies. A model with planes of symmetry is drawn
    without mirroring; another model is cut through the middle.
    """
    return {} if result.scene().mirrors else {"section": "y=middle", "camera": "0.35,-1,0.3"}


def _picture(result: Result, field: str, how: str, **options: Any) -> str:
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / f"{field}.png"
        try:
            drawn = result.view(field, out, size=_SIZE, transparent=True, captions=False, **options)
        except ViewError as error:
            return f"<p class=hint>{escape(field)}: {escape(str(error))}</p>"
        label = FIELDS[field].label
        image = html.image(_webp(out), "webp", f"{label} {how}")
        caption = f"<b>{escape(label)}</b> {escape(how)} {_key(drawn)}"
        return f"<figure class=plate>{image}<figcaption>{caption}</figcaption></figure>"


def _webp(path: Path) -> bytes:
    """Returns a picture as WebP, which has a tenth of the bytes of PNG."""
    from PIL import Image  # Pillow is a dependency of the package that has drawn the picture.

    packed = io.BytesIO()
    with Image.open(path) as image:
        image.save(packed, "WEBP", quality=88, method=5)
    return packed.getvalue()


def _key(drawn: Drawn) -> str:
    """Returns the colour bar of a picture as a coloured stripe with texts."""
    field = FIELDS[drawn.field]
    if field.kind == "fragments":
        return (
            "<span class=hint>each part has a hue, its fragments have variations of it; unbroken parts are pale</span>"
        )
    if field.kind == "classes":
        return ""
    low, high = exacts((drawn.low, drawn.high), drawn.unit, 4)
    if drawn.limits is None:
        return f"<span class=hint>{escape(low)} everywhere</span>"
    first, last = exacts(drawn.limits, drawn.unit, 4)
    stripe = f'<i style="background:linear-gradient(90deg,{",".join(field.colours)})"></i>'
    beyond = drawn.low < drawn.limits[0] or drawn.high > drawn.limits[1]
    note = f" <span class=hint>values from {escape(low)} to {escape(high)}</span>" if beyond else ""
    return f"<span class=scale>{escape(first)} {stripe} {escape(last)}</span>{note}"


# Charts ---------------------------------------------------------------------------------------------------------------


def curve(result: Result, name: str) -> list[str]:
    """Returns the charts of the history named ``name``; a text line with the error if matplotlib is not installed."""
    return charts(lambda: _curves().__dict__[name](result.history))


def fragments(result: Result) -> list[str]:
    """Returns charts of the number of fragments over time and of the masses of fragments."""
    tables = (result.fragments_of(index) for index in result.fragment_tables)
    return charts(lambda: _curves().fragments(list(tables)))


def balance(result: Result) -> list[str]:
    """Returns charts of surface nodes and CPU time of each rank."""
    messages = result.messages
    if not any(isinstance(message, Load) for message in messages):
        return []

    def draw() -> Any:
        from . import charts as drawing  # Loaded only if needed, because matplotlib loads slowly.

        return drawing.balance_figure(drawing.course(messages))

    return charts(draw)


def _curves() -> Any:
    from . import curves  # Loaded only if needed, because matplotlib loads slowly.

    return curves


def charts(draw: Callable[[], Any]) -> list[str]:
    """Returns each panel of a figure as an SVG in the colours of the text; empty if the run does not have the data."""
    try:
        figure = draw()
    except UnfinishedError:
        return []
    except ModuleNotFoundError as error:
        return [f"<p class=hint>charts need the extra 'view' of conoid: {escape(str(error))}</p>"]
    except ClientError as error:
        return [f"<p class=hint>{escape(str(error))}</p>"]
    return [_svg(figure, panel) for panel in figure.axes]


def _svg(figure: Any, panel: Any) -> str:
    import matplotlib as mpl

    _alone(figure, panel)
    title = panel.get_title()
    panel.set_title("")
    text = io.StringIO()
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": f"conoid{title}"}):
        figure.savefig(text, format="svg", transparent=True, metadata={"Date": None})
    body = text.getvalue()
    body = re.sub(r"<metadata>.*?</metadata>", "", body[body.index("<svg") :], flags=re.DOTALL)
    for colour in (_INK, "#000000"):
        body = body.replace(colour, "currentColor")
    used = set(re.findall(r"#([\w-]+)", body))
    body = re.sub(r' id="([\w.-]+)"', lambda found: found[0] if found[1] in used else "", body)
    body = re.sub(
        r'<svg[^>]*?viewBox="([^"]*)"[^>]*>', rf'<svg viewBox="\1" role=img aria-label="{escape(title)}">', body
    )
    return f"<h2>{escape(title)}</h2>{body}"


def _alone(figure: Any, panel: Any) -> None:
    """Leaves one panel in a figure, which gets the size of all charts of a report."""
    for each in figure.axes:
        each.set_visible(each is panel)
        each.set_in_layout(each is panel)
    panel.set_subplotspec(figure.add_gridspec(1, 1)[0, 0])
    figure.set_size_inches(*_CHART)
    figure.patch.set_visible(False)
    panel.patch.set_visible(False)
    panel.tick_params(labelsize=_LETTERS)
    for label in (panel.xaxis.label, panel.yaxis.label):
        label.set_size(_LETTERS)
    if (legend := panel.get_legend()) is not None:
        legend.get_frame().set_alpha(0.0)
        for text in legend.get_texts():
            text.set_size(_LETTERS)
