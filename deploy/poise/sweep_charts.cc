#include "deploy/poise/sweep_charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "deploy/poise/text_table.h"
#include "fmt/format.h"

namespace poise {
namespace {

using std::numbers::pi;

constexpr double kWidth = 560, kHeight = 440;
constexpr double kLeft = 70, kRight = 120, kTop = 34, kBottom = 52;
constexpr double kPlotWidth = kWidth - kLeft - kRight, kPlotHeight = kHeight - kTop - kBottom;
constexpr double kCenterX = kLeft + kPlotWidth / 2, kCenterY = kTop + kPlotHeight / 2;
constexpr double kRadius = kPlotHeight / 2 - 14;
constexpr size_t kMostTicks = 12;
constexpr char kOpening[] = "<svg ";
constexpr char kTextStyle[] =
    "text{font:11px system-ui,sans-serif;fill:#333} .t{font-size:13px;font-weight:600}\n"
    ".r{fill:#777;font-size:10px} .g{stroke:#ddd;stroke-width:1}\n";
// Okabe and Ito's: told apart by colour-blind readers too.
constexpr std::array kSeriesColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                       "#e69f00", "#56b4e9", "#000000", "#b0a000"};
using Rgb = std::array<double, 3>;
constexpr std::array<Rgb, 3> kShareStops = {{{213, 94, 0}, {242, 228, 190}, {0, 114, 178}}};
constexpr std::array<Rgb, 5> kValueStops = {  // viridis
    {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};

template <size_t n>
std::string Blend(const std::array<Rgb, n>& stops, double share) {
  const double at = std::clamp(share, 0.0, 1.0) * (n - 1);
  const auto i = std::min(static_cast<size_t>(at), n - 2);
  Rgb c;
  for (size_t k = 0; k < 3; ++k) {
    c[k] = stops[i][k] + (at - static_cast<double>(i)) * (stops[i + 1][k] - stops[i][k]);
  }
  return fmt::format("#{:02x}{:02x}{:02x}", std::lround(c[0]), std::lround(c[1]),
                     std::lround(c[2]));
}

/// Round numbers that span [low, high] and a little more.
std::vector<double> Ticks(double low, double high) {
  if (!(high > low)) high = low + std::max(1.0, std::abs(low));
  const double rough = (high - low) / 5;
  const double power = std::pow(10, std::floor(std::log10(rough)));
  double step = 10 * power;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough) {
      step = factor * power;
      break;
    }
  }
  std::vector<double> ticks;
  const double first = std::floor(low / step);
  for (double i = first; (i - 1) * step < high - 1e-9 * step; ++i) ticks.push_back(i * step);
  return ticks;
}

std::string Text(double x, double y, const std::string& text, const char* anchor,
                 const std::string& more = "") {
  return fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='{}'{}>{}</text>", x, y, anchor, more,
                     HtmlText(text));
}

std::string Open(const ChartLabels& labels) {
  return fmt::format("{}viewBox='0 0 {} {}' role='img'>", kOpening, kWidth, kHeight) +
         Text(kLeft, 18, labels.title, "start", " class='t'");
}

std::string AxisLabels(const ChartLabels& labels) {
  return Text(kCenterX, kHeight - 10, labels.x, "middle") +
         Text(16, kCenterY, labels.y, "middle",
              fmt::format(" transform='rotate(-90 16 {:.1f})'", kCenterY));
}

std::string Legend(const std::vector<ChartSeries>& series) {
  std::string svg;
  if (series.size() < 2 && (series.empty() || series[0].name.empty())) return svg;
  for (size_t i = 0; i < series.size(); ++i) {
    const double y = kTop + 12 + 18 * static_cast<double>(i);
    svg += fmt::format("<rect x='{}' y='{}' width='12' height='12' fill='{}'/>",
                       kWidth - kRight + 10, y - 10, kSeriesColours[i % kSeriesColours.size()]);
    svg += Text(kWidth - kRight + 26, y, series[i].name, "start");
  }
  return svg;
}

std::string ColourBar(const ChartScale& scale, const std::string& label) {
  std::string svg;
  constexpr int kSteps = 40;
  const double x = kWidth - kRight + 14, height = kPlotHeight - 20;
  for (int i = 0; i < kSteps; ++i) {
    const double share = (i + 0.5) / kSteps;
    svg += fmt::format("<rect x='{:.1f}' y='{:.1f}' width='14' height='{:.2f}' fill='{}'/>", x,
                       kTop + 20 + height * (1 - static_cast<double>(i + 1) / kSteps),
                       height / kSteps + 0.3,
                       scale.Colour(scale.low + share * (scale.high - scale.low)));
  }
  for (const double share : {0.0, 0.5, 1.0}) {
    svg += Text(x + 18, kTop + 24 + height * (1 - share),
                FormatNumber(scale.low + share * (scale.high - scale.low)), "start");
  }
  return svg + Text(x - 4, kTop + 10, label, "start");
}

/// A linear axis over data: pixel = place(value).
struct Axis {
  std::vector<double> ticks;
  double from, to;  // pixels

  Axis(double low, double high, double from_pixel, double to_pixel)
      : ticks(Ticks(low, high)), from(from_pixel), to(to_pixel) {}
  double operator()(double value) const {
    return from + (value - ticks.front()) / (ticks.back() - ticks.front()) * (to - from);
  }
};

std::string Grid(const Axis& x, const Axis& y) {
  std::string svg;
  for (const double tick : x.ticks) {
    svg +=
        fmt::format("<path class='g' d='M{0:.1f} {1} V{2}'/>", x(tick), kTop, kTop + kPlotHeight);
    svg += Text(x(tick), kTop + kPlotHeight + 16, FormatNumber(tick), "middle");
  }
  for (const double tick : y.ticks) {
    svg +=
        fmt::format("<path class='g' d='M{1} {0:.1f} H{2}'/>", y(tick), kLeft, kLeft + kPlotWidth);
    svg += Text(kLeft - 6, y(tick) + 4, FormatNumber(tick), "end");
  }
  return svg;
}

template <class Points, class Get>
std::pair<double, double> Range(const Points& points, const Get& get) {
  double low = INFINITY, high = -INFINITY;
  for (const auto& point : points) {
    low = std::min(low, get(point));
    high = std::max(high, get(point));
  }
  return low <= high ? std::pair{low, high} : std::pair{0.0, 1.0};
}

std::pair<double, double> PolarPlace(double degrees, double radius) {
  const double angle = degrees * pi / 180;
  return {kCenterX - radius * std::sin(angle), kCenterY - radius * std::cos(angle)};
}

std::string Spokes() {
  std::string svg;
  for (int degrees = 0; degrees < 360; degrees += 45) {
    const auto [x, y] = PolarPlace(degrees, kRadius);
    const auto [tx, ty] = PolarPlace(degrees, kRadius + 16);
    svg += fmt::format("<path class='g' d='M{:.1f} {:.1f} L{:.1f} {:.1f}'/>", kCenterX, kCenterY, x,
                       y);
    svg += Text(tx, ty + 4, fmt::format("{}°", degrees), "middle");
  }
  return svg;
}

std::vector<std::pair<double, double>> AllPoints(const std::vector<ChartSeries>& series) {
  std::vector<std::pair<double, double>> all;
  for (const ChartSeries& one : series) {
    all.insert(all.end(), one.points.begin(), one.points.end());
  }
  return all;
}

std::string Tip(const std::string& text) { return "<title>" + HtmlText(text) + "</title>"; }

}  // namespace

std::string HtmlText(const std::string& text) {
  std::string html;
  for (const char c : text) {
    switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      case '\'':
        html += "&#39;";
        break;
      default:
        html += c;
    }
  }
  return html;
}

std::string ChartScale::Colour(const std::optional<double>& value) const {
  if (!value) return "#cccccc";
  const double at = high > low ? (*value - low) / (high - low) : 0.5;
  return share ? Blend(kShareStops, at) : Blend(kValueStops, at);
}

ChartScale ScaleOf(const std::vector<ChartCell>& cells, bool share) {
  if (share) return {0, 1, true};
  ChartScale scale{INFINITY, -INFINITY, false};
  for (const ChartCell& cell : cells) {
    if (!cell.value) continue;
    scale.low = std::min(scale.low, *cell.value);
    scale.high = std::max(scale.high, *cell.value);
  }
  return scale.low <= scale.high ? scale : ChartScale{0, 1, false};
}

std::string CurveChart(const ChartLabels& labels, const std::vector<ChartSeries>& series) {
  const auto all = AllPoints(series);
  const auto [left, right] = Range(all, [](const auto& p) { return p.first; });
  const auto [low, high] = Range(all, [](const auto& p) { return p.second; });
  const Axis x(left, right, kLeft, kLeft + kPlotWidth);
  const Axis y(std::min(0.0, low), high, kTop + kPlotHeight, kTop);
  std::string svg = Open(labels) + Grid(x, y) + AxisLabels(labels) + Legend(series);
  for (size_t i = 0; i < series.size(); ++i) {
    const char* const colour = kSeriesColours[i % kSeriesColours.size()];
    std::string path;
    for (const auto& [px, py] : series[i].points) {
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : " L", x(px), y(py));
    }
    svg += fmt::format("<path d='{}' fill='none' stroke='{}' stroke-width='1.5'/>", path, colour);
    for (const auto& [px, py] : series[i].points) {
      svg += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='3' fill='{}'>{}</circle>", x(px),
                         y(py), colour, Tip(fmt::format("{}: {}", px, py)));
    }
  }
  return svg + "</svg>";
}

std::string PolarChart(const ChartLabels& labels, const std::vector<ChartSeries>& series) {
  const double high = Range(AllPoints(series), [](const auto& p) { return p.second; }).second;
  const Axis radius(0, std::max(high, 1e-12), 0, kRadius);
  std::string svg = Open(labels) + Spokes() + Legend(series);
  for (const double tick : radius.ticks) {
    svg += fmt::format("<circle class='g' cx='{:.1f}' cy='{:.1f}' r='{:.1f}' fill='none'/>",
                       kCenterX, kCenterY, radius(tick));
    svg +=
        Text(kCenterX + 3, kCenterY - radius(tick) - 2, FormatNumber(tick), "start", " class='r'");
  }
  for (size_t i = 0; i < series.size(); ++i) {
    const char* const colour = kSeriesColours[i % kSeriesColours.size()];
    std::string path;
    std::string dots;
    for (const auto& [angle, distance] : series[i].points) {
      const auto [x, y] = PolarPlace(angle, radius(std::max(0.0, distance)));
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : " L", x, y);
      dots += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='3' fill='{}'>{}</circle>", x, y,
                          colour, Tip(fmt::format("{} {}°: {}", series[i].name, angle, distance)));
    }
    svg += fmt::format(
        "<path d='{}{}' fill='{}' fill-opacity='0.08' stroke='{}' "
        "stroke-width='1.5'/>{}",
        path, path.empty() ? "" : " Z", colour, colour, dots);
  }
  return svg + Text(kCenterX, kHeight - 6, labels.y, "middle") + "</svg>";
}

std::string HeatMap(const ChartLabels& labels, const std::vector<std::string>& columns,
                    const std::vector<std::string>& rows, const std::vector<ChartCell>& cells,
                    const ChartScale& scale) {
  const double width = kPlotWidth / static_cast<double>(columns.size());
  const double height = kPlotHeight / static_cast<double>(rows.size());
  std::string svg = Open(labels) + AxisLabels(labels) + ColourBar(scale, labels.value);
  for (const ChartCell& cell : cells) {
    svg += fmt::format(
        "<rect x='{:.2f}' y='{:.2f}' width='{:.2f}' height='{:.2f}' fill='{}'>{}"
        "</rect>",
        kLeft + cell.x * width, kTop + kPlotHeight - (cell.y + 1) * height, width + 0.2,
        height + 0.2, scale.Colour(cell.value), Tip(cell.tip));
  }
  const auto each = [](size_t count) { return (count + kMostTicks - 1) / kMostTicks; };
  for (size_t i = 0; i < columns.size(); i += each(columns.size())) {
    svg += Text(kLeft + (static_cast<double>(i) + 0.5) * width, kTop + kPlotHeight + 16, columns[i],
                "middle");
  }
  for (size_t i = 0; i < rows.size(); i += each(rows.size())) {
    svg += Text(kLeft - 6, kTop + kPlotHeight - (static_cast<double>(i) + 0.5) * height + 4,
                rows[i], "end");
  }
  return svg + "</svg>";
}

std::string PolarHeatMap(const ChartLabels& labels, const std::vector<double>& angles,
                         const std::vector<std::string>& rows, const std::vector<ChartCell>& cells,
                         const ChartScale& scale) {
  double spread = 360;  // degrees a cell takes
  for (size_t i = 1; i < angles.size(); ++i) {
    spread = std::min(spread, std::abs(angles[i] - angles[i - 1]));
  }
  spread = std::min(std::max(spread, 0.1), 359.99);
  const double ring = kRadius / (static_cast<double>(rows.size()) + 0.5);
  std::string svg = Open(labels) + ColourBar(scale, labels.value);
  for (const ChartCell& cell : cells) {
    const double inner = (cell.y + 0.5) * ring, outer = inner + ring;
    const double begin = cell.x - spread / 2, end = cell.x + spread / 2;
    const auto [ax, ay] = PolarPlace(begin, inner);
    const auto [bx, by] = PolarPlace(begin, outer);
    const auto [cx, cy] = PolarPlace(end, outer);
    const auto [dx, dy] = PolarPlace(end, inner);
    const int large = spread > 180 ? 1 : 0;
    svg += fmt::format(
        "<path d='M{:.2f} {:.2f} L{:.2f} {:.2f} A{:.2f} {:.2f} 0 {} 0 {:.2f} {:.2f} "
        "L{:.2f} {:.2f} A{:.2f} {:.2f} 0 {} 1 {:.2f} {:.2f} Z' fill='{}'>{}</path>",
        ax, ay, bx, by, outer, outer, large, cx, cy, dx, dy, inner, inner, large, ax, ay,
        scale.Colour(cell.value), Tip(cell.tip));
  }
  svg += Spokes();
  for (size_t i = 0; i < rows.size(); i += (rows.size() + 5) / 6) {
    svg += Text(kCenterX + 3, kCenterY - (static_cast<double>(i) + 1) * ring + 4, rows[i], "start",
                " class='r'");
  }
  return svg + Text(kCenterX, kHeight - 6, labels.y, "middle") + "</svg>";
}

std::string ScatterChart(const ChartLabels& labels, const std::vector<ChartCell>& cells,
                         const ChartScale& scale) {
  const auto [left, right] = Range(cells, [](const ChartCell& c) { return c.x; });
  const auto [low, high] = Range(cells, [](const ChartCell& c) { return c.y; });
  const Axis x(left, right, kLeft, kLeft + kPlotWidth);
  const Axis y(low, high, kTop + kPlotHeight, kTop);
  std::string svg = Open(labels) + Grid(x, y) + AxisLabels(labels) + ColourBar(scale, labels.value);
  // The rare ones, which are those of low share, on top.
  std::vector<const ChartCell*> order;
  for (const ChartCell& cell : cells) order.push_back(&cell);
  std::stable_sort(order.begin(), order.end(), [](const ChartCell* a, const ChartCell* b) {
    return a->value.value_or(INFINITY) > b->value.value_or(INFINITY);
  });
  for (const ChartCell* cell : order) {
    svg += fmt::format(
        "<circle cx='{:.1f}' cy='{:.1f}' r='4' fill='{}' fill-opacity='0.85' "
        "stroke='#333' stroke-width='0.4'>{}</circle>",
        x(cell->x), y(cell->y), scale.Colour(cell->value), Tip(cell->tip));
  }
  return svg + "</svg>";
}

std::string StandaloneSvg(const std::string& chart) {
  const size_t attributes = sizeof(kOpening) - 1, content = chart.find('>') + 1;
  return fmt::format(
      "{}xmlns='http://www.w3.org/2000/svg' width='{}' height='{}' {}<style>{}</style>"
      "<rect width='100%' height='100%' fill='#fff'/>{}\n",
      kOpening, kWidth, kHeight, chart.substr(attributes, content - attributes), kTextStyle,
      chart.substr(content));
}

std::string ChartPage(const std::string& title, const std::vector<std::string>& paragraphs,
                      const std::vector<std::string>& charts) {
  std::string html = fmt::format(
      "<!doctype html>\n<html lang='en'><meta charset='utf-8'><title>{0}</title>\n<style>\n"
      "body{{font:14px system-ui,sans-serif;margin:24px;color:#222;background:#fff}}\n"
      "pre{{font-size:12px;overflow-x:auto}}\n"
      ".c{{display:flex;flex-wrap:wrap;gap:16px}}\n"
      "svg{{width:{1}px;max-width:100%;border:1px solid #ddd;background:#fff}}\n"
      "{2}</style>\n<h1>{0}</h1>\n",
      HtmlText(title), kWidth, kTextStyle);
  for (const std::string& paragraph : paragraphs) html += paragraph + "\n";
  html += "<div class='c'>\n";
  for (const std::string& chart : charts) html += chart + "\n";
  return html + "</div>\n</html>\n";
}

}  // namespace poise
