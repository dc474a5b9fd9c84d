"""Names that users chose stay text in Markdown."""

from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st

from internav_data.core.markdown import escaped, table_row


def test_a_name_breaks_no_table_and_begins_no_code_html_or_link():
    name = "a|b\n`c` <script> [x](y) \x1b[2J"
    assert table_row([name, "1"]) == ("| a\\|b \\`c\\` \\<script> \\[x\\](y) ?\\[2J | 1 |")


@given(st.lists(st.text(), min_size=1, max_size=4))
def test_a_row_has_as_many_cells_as_given(cells):
    row = table_row(cells)
    assert "\n" not in row
    assert len(re.findall(r"(?<!\\)(?:\\\\)*\|", row)) == len(cells) + 1


@given(st.text("ab -.%±0123456789"))
def test_plain_text_is_left_alone(text):
    assert escaped(text) == " ".join(text.split())
