# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Parts of a page, read by the parser of HTML."""

from html.parser import HTMLParser

import pytest

from aick_ros.reports import page

ODD = '<b>&"x"\' $title'


class Reader(HTMLParser):
    """Collects elements as (tag, attributes) and the texts between them."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.texts = [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_data(self, data):
        if data.strip():
            self.texts.append(data)


@pytest.mark.parametrize('part', [
    page.heading(ODD), page.paragraph(ODD), page.paragraph(ODD, 'quiet'),
    page.tiles([(ODD, ODD)]), page.table([ODD], [[ODD]])])
def test_texts_are_texts(part):
    assert set(Reader(part).texts) == {ODD}


def test_what_cannot_be_seen_or_is_not_utf_8_is_escaped():
    text = page.page('a\udcffb', page.heading('\x1b[31m'), page.table(['\u202e'], [['größe']]))
    text.encode()
    for shown in (r'<title>a\xffb</title>', r'\x1b[31m', r'\u202e', 'größe'):
        assert shown in text


def test_headings_have_levels_and_paragraphs_kinds():
    assert Reader(page.heading('x', 1)).elements == [('h1', {})]
    assert Reader(page.heading('x')).elements == [('h2', {})]
    assert Reader(page.paragraph('x')).elements == [('p', {})]
    assert Reader(page.paragraph('x', 'notice')).elements == [('p', {'class': 'notice'})]


def test_a_tile_shows_its_value_above_its_label():
    assert Reader(page.tiles([('label', 'value'), ('other', '5')])).texts == [
        'value', 'label', '5', 'other']


@pytest.mark.parametrize('length, is_long', [(60, False), (61, True)])
def test_cells_of_many_characters_are_kept_wide(length, is_long):
    cell = Reader(page.table(['head'], [['x' * length]])).elements[-1]
    assert cell == ('td', {'class': 'long'} if is_long else {})


def test_tables_have_a_head_and_rows_in_order():
    reader = Reader(page.table(['a', 'b'], [['1', '2'], ['3', '4']], is_sortable=True))
    assert reader.texts == ['a', 'b', '1', '2', '3', '4']
    assert ('table', {'class': 'sortable'}) in reader.elements
    assert [tag for tag, _ in reader.elements].count('tr') == 3
    assert ('table', {}) in Reader(page.table(['a'], [])).elements


def test_a_page_has_its_title_its_parts_in_order_and_a_script_only_to_sort():
    for sorts in (False, True):
        text = page.page(ODD, page.heading('first'), page.picture('<svg></svg>'),
                         sorts_tables=sorts)
        reader = Reader(text)
        assert reader.texts[0] == ODD and text.index('first') < text.index('<svg>')
        tags = [tag for tag, _ in reader.elements]
        assert ('script' in tags) is sorts and 'link' not in tags and 'img' not in tags
        assert tags.index('figure') < tags.index('svg')


def test_every_element_is_closed_in_order():
    class Balance(HTMLParser):
        def handle_starttag(self, tag, attrs):
            if tag != 'meta':
                opened.append(tag)

        def handle_endtag(self, tag):
            assert opened.pop() == tag
            closed.append(tag)

    opened, closed = [], []
    Balance().feed(page.page(
        ODD, page.heading(ODD), page.paragraph(ODD, 'quiet'), page.tiles([(ODD, ODD), ('a', 'b')]),
        page.table([ODD, 'x'], [[ODD, 'y'], ['z', 70 * 'w']]), page.picture('<svg></svg>')))
    assert opened == []
    assert (closed.count('tr'), closed.count('td'), closed.count('th')) == (3, 4, 2)


def test_a_page_has_no_script_unless_it_is_asked_for():
    assert '<script' not in page.page('x', page.table(['a'], [['1']]))
    assert 'class="sortable"' not in page.table(['a'], [['1']])
