# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The pages in headless Chromium: narrow and wide, light and dark, with hostile names."""

import dataclasses
import html
import json
import re
import shutil
import subprocess
from datetime import datetime

import pytest

from aick_ros.evaluation.comparison.comparison import Change, Comparison, Verdict
from aick_ros.evaluation.comparison.metrics import ATE, LOST
from aick_ros.reports.comparison_page import comparison_page
from aick_ros.reports.fleet_page import fleet_page
from aick_ros.reports.run_report import report

BROWSERS = ('chromium-headless-shell', 'chromium', 'chromium-browser', 'google-chrome')
HOSTILE = '<img src="http://127.0.0.1:9/x.png" onerror="parent.hacked = true"></script>&amp;$x$'
WIDTHS = 400, 1400

# Each page is in frames of both widths. Whatever would leave it is a violation of its policy.
FRAME = '''<meta http-equiv="Content-Security-Policy"
content="default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<script>
window.problems = [];
addEventListener('error', event => problems.push(event.message));
addEventListener('securitypolicyviolation', event => problems.push(event.blockedURI));
for (const kind of ['error', 'warn']) console[kind] = text => problems.push(String(text));
</script>'''

HARNESS = '''<!DOCTYPE html><meta charset="utf-8"><body><script>
const pages = PAGES, facts = [];
const channels = colour => colour.match(/[0-9.]+/g).map(Number);
const luminance = colour => channels(colour).slice(0, 3).map(value => value / 255)
  .map(value => value <= .04045 ? value / 12.92 : ((value + .055) / 1.055) ** 2.4)
  .reduce((sum, value, index) => sum + value * [.2126, .7152, .0722][index], 0);
const contrast = element => {
  let behind = element;
  const fill = () => getComputedStyle(behind).backgroundColor;
  while (behind.parentElement && channels(fill())[3] === 0) behind = behind.parentElement;
  const [a, b] = [luminance(getComputedStyle(element).color), luminance(fill())];
  return (Math.max(a, b) + .05) / (Math.min(a, b) + .05);
};
function look(frame, name, width) {
  const page = frame.contentDocument, all = selector => [...page.querySelectorAll(selector)];
  const head = page.querySelector('.sortable th:nth-child(2)'), sorted = [];
  for (let turn = 0; head && turn < 2; turn++) {
    head.click();
    sorted.push([...head.closest('table').tBodies[0].rows].map(row => row.cells[1].textContent));
  }
  facts.push({name, width, sorted, title: page.title, images: all('img').length,
    problems: frame.contentWindow.problems, hacked: window.hacked === true,
    overflow: page.documentElement.scrollWidth - page.documentElement.clientWidth,
    background: luminance(getComputedStyle(page.body).backgroundColor),
    contrast: Math.min(...all('h1, h2, p, th, td, .tile b, .tile span').map(contrast)),
    figures: all('figure svg').map(svg => svg.getBoundingClientRect().width),
    cells: Math.min(...all('td').filter(cell => cell.textContent.length > 60)
      .map(cell => cell.getBoundingClientRect().width), 999)});
}
let waiting = 0;
for (const [name, content] of Object.entries(pages)) for (const width of WIDTHS) {
  waiting++;
  const frame = document.createElement('iframe');
  Object.assign(frame, {srcdoc: content, width, height: 900, onload: () => {
    look(frame, name, width);
    if (!--waiting) {
      const result = document.createElement('pre');
      result.textContent = JSON.stringify(facts);
      result.id = 'facts';
      document.body.append(result);
    }
  }});
  document.body.append(frame);
}
</script>'''


def comparison():
    worse = Change(0.01, 0.012, 0.2, 0.1, 0.3, Verdict.WORSE)
    better = dataclasses.replace(worse, baseline=0.05, verdict=Verdict.BETTER)
    return {HOSTILE: Comparison(
        {HOSTILE: {ATE: better, LOST: worse}, 'x' * 150: {ATE: worse, LOST: worse}},
        {ATE: worse, LOST: worse}, [HOSTILE], ['second'], {'aick.alpha': (0.7, HOSTILE)})}


def rows():
    """Return a table of three runs and a failure."""
    return [{'source': HOSTILE, 'recording': HOSTILE, 'variant': f'{mode}={HOSTILE}',
             'status': status, 'cause': 'process lost', 'reason': HOSTILE, 'frames': 300,
             'duration_s': 10.0, 'trajectory.rpe_1s_translation_rmse_m': error,
             'trajectory.ate_rmse_m': error}
            for mode, status, error in (('joint', 'done', 0.02), ('joint', 'done', 0.01),
                                        ('none', 'done', 0.01), ('none', 'failed', None))]


@pytest.fixture
def pages(summary, records, ground_truth):
    hostile = dataclasses.replace(summary, source=HOSTILE, ended=HOSTILE)
    records[41] = dataclasses.replace(records[41], reason=HOSTILE)
    return {'report': report(hostile, records, ground_truth, datetime(2026, 3, 4)),
            'comparison': comparison_page(HOSTILE, comparison()),
            'fleet': fleet_page(rows())}


@pytest.fixture
def seen(pages, tmp_path):
    """Return a function from dark or light to what Chromium shows, by page and width."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        pytest.skip('no headless Chromium: apt-get install chromium-headless-shell')
    framed = {name: text.replace('<head>', f'<head>{FRAME}') for name, text in pages.items()}
    content = json.dumps(framed).replace('</', '<\\/')
    (tmp_path / 'all.html').write_text(
        HARNESS.replace('PAGES', content).replace('WIDTHS', str(list(WIDTHS))))

    def look(is_dark):
        dom = subprocess.run(
            [browser, '--headless', '--no-sandbox', '--disable-gpu', '--disable-extensions',
             '--virtual-time-budget=10000', f'--user-data-dir={tmp_path / "profile"}',
             f'--blink-settings=preferredColorScheme={0 if is_dark else 1}', '--dump-dom',
             (tmp_path / 'all.html').as_uri()],
            capture_output=True, text=True, timeout=300, check=True).stdout
        facts = json.loads(html.unescape(re.search('<pre id="facts">(.*)</pre>', dom)[1]))
        assert {(fact['name'], fact['width']) for fact in facts} == {
            (name, width) for name in pages for width in WIDTHS}
        return facts
    return look


@pytest.mark.parametrize('is_dark', [False, True], ids=['light', 'dark'])
def test_pages_are_harmless_readable_and_sorted(seen, is_dark):
    for fact in seen(is_dark):
        assert fact['problems'] == [], fact
        assert not fact['hacked'] and fact['images'] == 0
        assert fact['title']
        assert fact['overflow'] <= 0, fact
        assert (fact['background'] < 0.1) == is_dark, fact
        assert fact['contrast'] >= 4.5, fact  # WCAG 2.1, level AA
        assert fact['figures'] and min(fact['figures']) >= 500, fact
        assert fact['cells'] >= 150, fact  # long sentences are no column of letters
        if fact['name'] != 'report':
            up, down = fact['sorted']
            assert len(set(up)) > 1
            assert down == up[::-1] and up == sorted(up), fact


def test_axes_have_units(pages):
    for name, text in pages.items():
        for svg in re.findall('<svg.*?</svg>', text, re.DOTALL):
            assert re.search(r'<!-- [^<>]*\[[^<>]+\][^<>]* -->', svg), name
