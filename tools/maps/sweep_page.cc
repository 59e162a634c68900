#include "tools/maps/sweep_page.h"

#include <string_view>

#include "fmt/format.h"
#include "tools/maps/sweep_charts.h"

namespace poise {
namespace {

constexpr size_t kFewCharts = 4;  // are not folded away

constexpr std::string_view kStyle = R"(
:root{color-scheme:light dark;--page:#f4f6f9;--panel:#fff;--ink:#1d1d1f;--soft:#5a6270;--line:#d5dae2}
@media(prefers-color-scheme:dark){:root{--page:#101318;--panel:#1a1e25;--ink:#eceff4;--soft:#a3adbb;--line:#323a46}}
*{box-sizing:border-box}
body{font:14px/1.45 system-ui,sans-serif;margin:0 auto;padding:20px 16px;max-width:1500px;color:var(--ink);background:var(--page)}
h1{font-size:20px;margin:0 0 4px}h2{font-size:15px;margin:18px 0 6px}p{margin:4px 0}
.soft{color:var(--soft)}.edge{font-size:16px;max-width:75em}
pre{font:12px/1.4 ui-monospace,"DejaVu Sans Mono",monospace;overflow-x:auto;background:var(--panel);border:1px solid var(--line);border-radius:8px;padding:10px 12px}
.c{display:grid;gap:12px;grid-template-columns:repeat(auto-fill,minmax(min(100%,430px),1fr))}
.c svg{width:100%;max-width:620px;border:1px solid var(--line);border-radius:8px;background:var(--panel)}
summary{cursor:pointer;font-weight:600;margin:18px 0 8px}
#tip{position:fixed;z-index:9;pointer-events:none;white-space:pre-line;max-width:min(320px,90vw);font-size:12px;padding:6px 9px;border-radius:6px;background:var(--ink);color:var(--page)}
#tip[hidden]{display:none}
#tip.kept{pointer-events:auto;user-select:text;overflow-wrap:anywhere;max-width:min(640px,90vw);border:1px solid var(--line)}
@media print{body{max-width:none}.c svg{break-inside:avoid}}
)";

// What a mark says, at once and from near by, instead of the browser's late little text.
constexpr std::string_view kScript = R"(
(() => {
  const NEAR = 14, tip = document.getElementById('tip');
  for (const title of document.querySelectorAll('.c title')) {
    title.parentElement.dataset.tip = title.textContent;
    title.remove();
  }
  const near = (svg, e) => {
    let best = null, least = NEAR;
    for (const mark of svg.querySelectorAll('circle[data-tip],path.f[data-tip]')) {
      const box = mark.getBoundingClientRect();
      const d = Math.hypot(box.x + box.width / 2 - e.clientX, box.y + box.height / 2 - e.clientY);
      if (d < least) [best, least] = [mark, d];
    }
    return best;
  };
  const show = (e) => {
    if (e.target.closest?.('#tip.kept') || (tip.classList.contains('kept') && e.type !== 'pointerdown')) return;
    const svg = e.target.closest?.('.c svg');
    const mark = svg && (e.target.closest('[data-tip]') ?? near(svg, e));
    tip.hidden = !mark;
    tip.classList.toggle('kept', !!mark && e.type === 'pointerdown');
    if (!mark) return;
    tip.textContent = mark.dataset.tip;
    const {width, height} = tip.getBoundingClientRect();
    tip.style.left = `${Math.max(4, Math.min(e.clientX + 14, innerWidth - width - 4))}px`;
    tip.style.top = `${e.clientY + 18 + height > innerHeight ? Math.max(4, e.clientY - height - 12) : e.clientY + 18}px`;
  };
  for (const event of ['pointermove', 'pointerdown']) document.addEventListener(event, show);
  document.addEventListener('scroll', () => { tip.hidden = true; tip.classList.remove('kept'); }, {passive: true});
  addEventListener('beforeprint', () => document.querySelectorAll('details').forEach((d) => { d.open = true; }));
})();
)";

std::string Grid(const std::vector<std::string>& charts) {
  std::string html = "<div class='c'>\n";
  for (const std::string& chart : charts) html += chart + "\n";
  return html + "</div>\n";
}

}  // namespace

std::string FormatMapsPage(const MapsPageContent& content) {
  std::string html = fmt::format(
      "<!doctype html>\n<html lang='en'><meta charset='utf-8'>"
      "<meta name='viewport' content='width=device-width, initial-scale=1'>\n"
      "<meta http-equiv='Content-Security-Policy' content=\"default-src 'none'; script-src "
      "'unsafe-inline'; style-src 'unsafe-inline'; img-src data:\">\n"
      "<link rel='icon' href='data:,'><title>{0}</title>\n<style>{1}{2}</style>\n<h1>{0}</h1>\n",
      HtmlText(content.title), kStyle, ChartStyle(true));
  if (!content.description.empty()) {
    html += "<p class='soft'>" + HtmlText(content.description) + "</p>\n";
  }
  if (!content.edge.empty()) html += "<h2>Where survival ends</h2>\n";
  for (const std::string& sentence : content.edge) {
    html += "<p class='edge'>" + HtmlText(sentence) + "</p>\n";
  }
  if (!content.survival.empty() || !content.metrics.empty()) {
    html +=
        "<p class='soft'>Each mark is what was run; nothing is known between two marks. Under the "
        "mouse it tells the command that runs it again, and a click keeps that there to be "
        "copied.</p>\n";
  }
  html += Grid(content.survival);
  for (const std::string& table : content.tables) html += "<pre>" + HtmlText(table) + "</pre>\n";
  if (!content.metrics.empty()) {
    const size_t count = content.metrics.size();
    html += fmt::format(
        "<details{}><summary>What the runs measured: {} map{}</summary>\n{}</details>\n",
        count <= kFewCharts ? " open" : "", count, count == 1 ? "" : "s", Grid(content.metrics));
  }
  if (!content.constants.empty()) {
    html += "<details><summary>The same in every run that stands</summary>\n";
    for (const std::string& sentence : content.constants) {
      html += "<p class='soft'>" + HtmlText(sentence) + "</p>\n";
    }
    html += "</details>\n";
  }
  return html + "<div id='tip' role='status' hidden></div>\n<script>" + std::string(kScript) +
         "</script>\n</html>\n";
}

}  // namespace poise
