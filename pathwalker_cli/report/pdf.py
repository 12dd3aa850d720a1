"""A page as a PDF file, set from the same values as the one in HTML, without a browser."""

from __future__ import annotations

import io
import logging
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from fpdf import FPDF
from fpdf.enums import TableBordersLayout
from fpdf.fonts import FontFace
from matplotlib import get_data_path
from matplotlib.font_manager import get_font

from pathwalker_cli import __version__
from pathwalker_cli.report.content import Drawing, Fact, Page, Section, Shape, Table, tight
from pathwalker_cli.stride.figures.inline import outlined_svg

logging.getLogger("fpdf.svg").setLevel(logging.ERROR)  # it knows no hatches; outlines stay

_MARGINS: Final = (11.0, 8.0)
"""Margins left and right, above and below [mm]."""
_FONT: Final = "DejaVu"
"""The font of the figures, which Matplotlib brings along and which knows most letters."""
_TEXT, _SMALL, _LARGE, _HEADING, _TITLE = 7.6, 6.8, 8.8, 9.5, 13.0
"""Sizes of text, of tables and notes, of the answer, of headings and of the title [pt]."""
_LEADING: Final = 0.435
"""Distance of lines over size of text [mm/pt]."""
_BLUE, _ORANGE, _GREY = (0, 114, 178), (213, 94, 0), 68
_COLUMNS: Final[dict[Shape, int]] = {"panel": 4, "pair": 2, "tall": 2, "page": 1}
"""How many figures of a shape stand side by side."""
_CELL: Final = 1.0
"""Space left and right of the text in a cell [mm]."""
_GOOD: Final = 1
"""The column that is bold in a row that is marked as good."""
_NARROWEST: Final = 38.0
"""Width that a column of prose has at least [mm]."""


def page_pdf(page: Page) -> bytes:
    """Return a page as a PDF file."""
    sheet = _Sheet()
    sheet.head(page)
    for section in page.sections:
        sheet.section(section)
    sheet.foot(f"{page.notice} Made with PathWalker {__version__}.")
    return bytes(sheet.output())


class _Sheet(FPDF):
    """An A4 document that is filled from above."""

    def __init__(self) -> None:
        super().__init__(format="A4")
        fonts = Path(get_data_path()) / "fonts" / "ttf"
        for weight, file in (("", "DejaVuSans.ttf"), ("B", "DejaVuSans-Bold.ttf")):
            self.add_font(_FONT, weight, fonts / file)
        self.letters = frozenset(get_font(fonts / "DejaVuSans-Bold.ttf").get_charmap())
        self.set_margins(*_MARGINS)
        self.c_margin = 0.0
        self.set_auto_page_break(True, _MARGINS[1])
        self.add_page()

    def head(self, page: Page) -> None:
        """Set title, facts, answer and warnings."""
        self.set_title(page.title)
        self._text(page.title, _TITLE, bold=True)
        self._facts(page.facts, _TEXT)
        top = self.get_y() + 1.0
        self.set_y(top)
        for sentence in page.answer:
            self._text(sentence, _LARGE, indent=3.0)
        self.set_draw_color(*_BLUE)
        self.set_line_width(1.0)
        self.line(self.l_margin + 0.5, top, self.l_margin + 0.5, self.get_y())
        self.set_text_color(*_ORANGE)
        for warning in page.warnings:
            self._text(f"{warning}.", _TEXT, bold=True)
        self.set_text_color(0)

    def section(self, section: Section) -> None:
        """Set a section in the order of the page in HTML."""
        if section.new_page or self.will_page_break(25.0):
            self.add_page()
        self.ln(1.6)
        self._text(section.title, _HEADING, bold=True)
        self._rule(0.3, 0)
        self.ln(0.4)
        for table in section.tables:
            self._table(table)
        self._facts(section.facts, _SMALL)
        for line in section.lines:
            self._text(line, _TEXT)
        for point in section.points:
            self._text(f"\N{BULLET} {point}.", _TEXT)
        self._drawings(section.drawings)

    def foot(self, text: str) -> None:
        """Set what stands below everything."""
        self._rule(0.3, 0)
        self._text(text, _SMALL, bold=True)

    def _text(self, text: str, size: float, bold: bool = False, indent: float = 0.0) -> None:
        self.set_font(_FONT, "B" if bold else "", size)
        self.set_x(self.l_margin + indent)
        self.multi_cell(0, _LEADING * size, self._known(text), align="L", new_x="LMARGIN",
                        new_y="NEXT")  # fmt: skip

    def _known(self, text: str) -> str:
        """Return a text with whole units, without characters that the font does not have."""
        return "".join(c if ord(c) in self.letters else "?" for c in tight(text))

    def _rule(self, width: float, grey: int) -> None:
        """Draw a line across the page."""
        self.set_draw_color(grey)
        self.set_line_width(width)
        self.line(self.l_margin, self.get_y(), self.w - self.r_margin, self.get_y())

    def _facts(self, facts: Sequence[Fact], size: float) -> None:
        """Set facts one after the other; one that does not fit begins a new line."""
        for fact in facts:
            self.set_font(_FONT, "B", size)
            width = self.get_string_width(self._known(f"{fact.label}  {fact.text}")) + 4.0
            if self.get_x() > self.l_margin and self.get_x() + width > self.w - self.r_margin:
                self.ln(_LEADING * size)
            self.write(_LEADING * size, f"{self._known(fact.label)}  ")
            self.set_font(_FONT, "", size)
            self.write(_LEADING * size, f"{self._known(fact.text)}    ")
        if facts:
            self.ln(_LEADING * size)

    def _table(self, table: Table) -> None:
        """Set a table with its caption and notes."""
        if table.caption:
            self._text(table.caption, _SMALL)
        widths = tuple(self._widths(table))
        self.set_font(_FONT, "", _SMALL)
        self.set_draw_color(190)
        self.set_line_width(0.1)
        align = tuple("RIGHT" if kind == "n" else "LEFT" for kind in table.columns)
        with super().table(
            col_widths=widths, text_align=align, line_height=_LEADING * _SMALL,
            headings_style=FontFace(emphasis="B"), padding=(0.25, _CELL), v_align="TOP",
            borders_layout=TableBordersLayout.HORIZONTAL_LINES,
        ) as grid:  # fmt: skip
            grid.row([self._known(cell) for cell in table.head])
            for row in table.rows:
                line = grid.row()
                for i, cell in enumerate(row.cells):
                    bold = row.mark == "heading" or (i == _GOOD and row.mark == "good")
                    last = i == len(row.cells) - 1
                    span = len(table.head) - i if last else 1
                    style = FontFace(emphasis="B") if bold else None
                    line.cell(self._known(cell), colspan=span, style=style)
        self.set_text_color(_GREY)
        for note in table.notes:
            self._text(f"{note}.", 0.93 * _SMALL)
        self.set_text_color(0)

    def _widths(self, table: Table) -> Iterator[float]:
        """Yield the widths of the columns: prose shares what words and numbers leave."""
        whole = [row.cells for row in table.rows if len(row.cells) == len(table.head)]
        natural = []
        for i, (kind, head) in enumerate(zip(table.columns, table.head, strict=True)):
            cells = [] if kind == "p" else [row[i] for row in whole]
            bold = [*self._known(head).split(" "), *(cells if i == _GOOD else ())]
            widest = max(self._width("B", bold), self._width("", cells))
            natural.append(widest + 2.0 * _CELL + 0.5)
        prose = [i for i, kind in enumerate(table.columns) if kind == "p"]
        if table.even and prose:
            natural[0] = min(natural[0], 24.0)
        fixed = sum(width for i, width in enumerate(natural) if i not in prose)
        left = self.epw - fixed
        for i, width in enumerate(natural):
            if i in prose:
                yield max(left / len(prose), _NARROWEST)
            else:
                yield width if prose else width + left / len(natural)

    def _width(self, style: str, texts: Sequence[str]) -> float:
        """Return the width of the longest text in a table [mm]."""
        self.set_font(_FONT, style, _SMALL)
        known = (self._known(text) for text in texts)
        return max(map(self.get_string_width, known), default=0.0)

    def _drawings(self, drawings: Sequence[Drawing]) -> None:
        """Set figures side by side in rows."""
        x = below = 0.0
        for drawing in drawings:
            width = self.epw / _COLUMNS[drawing.shape]
            inches = drawing.figure.get_size_inches()
            height = width * inches[1] / inches[0]
            if x + width > self.epw + 1.0:
                self.set_y(self.get_y() + below)
                x = below = 0.0
            if self.will_page_break(height):
                self.add_page()
            place = {"x": self.l_margin + x, "y": self.get_y(), "w": width, "h": height}
            svg = io.BytesIO(outlined_svg(drawing.figure))
            self.image(svg, alt_text=drawing.title, keep_aspect_ratio=True, **place)
            x, below = x + width, max(below, height)
        self.set_y(self.get_y() + below)
