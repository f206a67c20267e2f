# SPDX-License-Identifier: Apache-2.0
"""What is asked of every page with plots (src/fbvins/page) in a browser."""
import json
import re

WIDTHS_PX = (1400, 1000, 700, 480, 390)


def drawn(chromium, page, theme, least):
    """The page's elements after its script has run without an error and has drawn at least so many plots."""
    shown = chromium.open(f"file://{page}#{theme}", width=1400, height=1200)
    shown.wait_for("document.documentElement.dataset.ready || document.documentElement.dataset.error")
    dom = shown.value("document.documentElement.outerHTML")
    html = re.search(r"<html[^>]*>", dom)[0]
    assert "data-error" not in html, html
    assert f'data-theme="{theme}"' in html, html
    ready = re.search(r'data-ready="(\d+)"', html)
    assert ready, "the page's script did not reach its end: " + html
    plots = re.findall(r"<svg[^>]*>", dom)
    assert len(plots) == int(ready[1]) >= least, (len(plots), ready[1])
    empty = [p for p in plots if int((re.search(r'data-points="(\d+)"', p) or [0, 0])[1]) < 2]
    assert not empty, empty
    dom = re.sub(r"(?s)<script.*?</script>", "", dom)
    assert "NaN" not in dom, "a coordinate of a plot is not a number"
    return dom


def check_layout(chromium, page):
    """At every width all columns of tables are seen and all axes are named. Returns the page as it is shown last."""
    for width in WIDTHS_PX:
        shown = chromium.open(f"file://{page}#light", width=width, height=1000)
        shown.wait_for("document.documentElement.dataset.ready")
        cut = shown.value("JSON.stringify([...document.querySelectorAll('.scroll')].filter(s => s.scrollWidth > s.clientWidth + 1).map(s => s.innerText.slice(0, 60)))")
        assert json.loads(cut) == [], f"columns are cut off at {width} px: {cut}"
        assert shown.value("document.documentElement.scrollWidth") <= width, f"the page is wider than {width} px"
        bare = shown.value("JSON.stringify([...document.querySelectorAll('svg')].map(s => s.dataset.axes || '').filter(a => !/^[^|]+ \\| .+$/.test(a)))")
        assert json.loads(bare) == [], f"axes without names: {bare}"
    unnamed = shown.value("[...document.querySelectorAll('svg.plot')].filter(s => !s.querySelector('.axis-name')?.textContent).length")
    assert unnamed == 0, unnamed
    return shown
