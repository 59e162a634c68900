#include "tools/maps/sweep_charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "fmt/format.h"
#include "tools/cli/text_table.h"
#include "tools/maps/svg_frame.h"

namespace poise {
namespace {

using std::numbers::pi;
using Rgb = std::array<double, 3>;

constexpr double kTop = SvgFrame::kTop, kPlotHeight = SvgFrame::kPlotHeight,
                 kPlotWidth = SvgFrame::kPlotWidth, kBase = kTop + kPlotHeight;
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

/// Least and largest of what `get` gives of the items; [0, 1] of none.
template <class Items, class Get>
std::pair<double, double> Range(const Items& items, const Get& get) {
  double low = INFINITY, high = -INFINITY;
  for (const auto& item : items) {
    const std::optional<double> value = get(item);
    if (!value || !std::isfinite(*value)) continue;
    low = std::min(low, *value);
    high = std::max(high, *value);
  }
  return low <= high ? std::pair{low, high} : std::pair{0.0, 1.0};
}

std::optional<double> XOf(const ChartPoint& point) { return point.x; }
std::optional<double> YOf(const ChartPoint& point) {
  return point.fallen || point.untold ? std::nullopt : point.y;
}

std::vector<ChartPoint> AllPoints(const std::vector<ChartSeries>& series) {
  std::vector<ChartPoint> all;
  for (const ChartSeries& one : series) {
    all.insert(all.end(), one.points.begin(), one.points.end());
  }
  return all;
}

bool AnyFell(const std::vector<ChartPoint>& points) {
  return std::ranges::any_of(points, &ChartPoint::fallen);
}

bool AnyUntold(const std::vector<ChartPoint>& points) {
  return std::ranges::any_of(points, &ChartPoint::untold);
}

/// The axes of curves and points: the strip of what has no value is above the range of the others.
struct PlotAxes {
  SvgAxis x, y;
  double strip;  ///< pixel, of what fell or does not tell

  PlotAxes(const SvgFrame& frame, const std::vector<ChartPoint>& points, bool from_zero, bool share)
      : x(Range(points, XOf).first, Range(points, XOf).second, frame.left, frame.right_edge()),
        y(share       ? 0
          : from_zero ? std::min(0.0, Range(points, YOf).first)
                      : Range(points, YOf).first,
          share ? 1 : Range(points, YOf).second, kBase,
          kTop + (AnyFell(points) || AnyUntold(points) ? SvgFrame::kStrip : 0)),
        strip(kTop + SvgFrame::kStrip / 2) {}
};

std::vector<LegendEntry> SeriesEntries(const std::vector<ChartSeries>& series,
                                       const std::vector<ChartPoint>& all) {
  std::vector<LegendEntry> entries;
  for (size_t i = 0; i < series.size(); ++i) {
    if (!series[i].name.empty()) entries.push_back(SwatchEntry(SeriesFill(i), series[i].name));
  }
  if (AnyFell(all)) entries.push_back(FallenEntry());
  if (AnyUntold(all)) entries.push_back(UntoldEntry());
  return entries;
}

void FitRight(const std::vector<LegendEntry>& entries, SvgFrame* frame) {
  std::vector<std::string> texts;
  for (const LegendEntry& entry : entries) texts.push_back(entry.text);
  FitRight(texts, frame);
}

std::string Dot(double x, double y, size_t series, const std::string& tip) {
  return fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='3' {}>{}</circle>", x, y,
                     SeriesFill(series), SvgTip(tip));
}

/// "M.. L.." through the places; empty ones interrupt it.
std::string Path(const std::vector<std::optional<std::pair<double, double>>>& places) {
  std::string path;
  bool on = false;
  for (const auto& place : places) {
    if (place) {
      path += fmt::format("{}{:.1f} {:.1f}", on ? " L" : " M", place->first, place->second);
    }
    on = place.has_value();
  }
  return path;
}

std::pair<double, double> PolarPlace(const SvgFrame& frame, double degrees, double radius) {
  const double angle = degrees * pi / 180;
  return {frame.center_x() - radius * std::sin(angle),
          SvgFrame::center_y() - radius * std::cos(angle)};
}

std::string Spokes(const SvgFrame& frame) {
  std::string svg;
  for (int degrees = 0; degrees < 360; degrees += 45) {
    const auto [x, y] = PolarPlace(frame, degrees, SvgFrame::radius());
    const auto [tx, ty] = PolarPlace(frame, degrees, SvgFrame::radius() + 22);
    svg += fmt::format("<path class='g' d='M{:.1f} {:.1f} L{:.1f} {:.1f}'/>", frame.center_x(),
                       SvgFrame::center_y(), x, y);
    svg += SvgText(tx, ty + 4, fmt::format("{}°", degrees), "middle");
  }
  return svg;
}

/// Whether each cell is one run that stands or does not: a bar of shares would tell nothing more.
bool AllOrNothing(const std::vector<ChartCell>& cells, const ChartScale& scale) {
  return scale.share && std::ranges::all_of(cells, [](const ChartCell& c) {
           return c.untold || (c.value && (*c.value == 0 || *c.value == 1));
         });
}

/// `fallen`: how a cell that fell is drawn.
std::string ScaleLegend(const SvgFrame& frame, const std::vector<ChartCell>& cells,
                        const ChartScale& scale, const std::string& unit,
                        const LegendEntry& fallen) {
  std::vector<LegendEntry> above;
  if (std::ranges::any_of(cells, &ChartCell::untold)) above.push_back(UntoldEntry());
  if (!AllOrNothing(cells, scale)) {
    if (std::ranges::any_of(cells, &ChartCell::fallen)) above.push_back(fallen);
    if (std::ranges::any_of(cells, &ChartCell::some_fallen)) {
      above.push_back({FallenMark(0, 0, ""), "some did not"});
    }
    return ColourBar(frame, scale, unit, above);
  }
  const auto swatch = [&](double value, const char* text) {
    return SwatchEntry(fmt::format("fill='{}'", scale.Colour(value)), text);
  };
  above.insert(above.begin(), {swatch(1, "stands"), swatch(0, "does not")});
  return Legend(frame, above);
}

std::string CellFill(const ChartCell& cell, const ChartScale& scale) {
  return cell.fallen ? "class='ff'" : fmt::format("fill='{}'", scale.Colour(cell.value));
}

}  // namespace

std::string HtmlText(std::string_view text) {
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
  const auto [low, high] =
      Range(cells, [](const ChartCell& cell) { return cell.fallen ? std::nullopt : cell.value; });
  return {low, high, false};
}

std::string CurveChart(const ChartLabels& labels, const std::vector<ChartSeries>& series) {
  const std::vector<ChartPoint> all = AllPoints(series);
  const std::vector<LegendEntry> entries = SeriesEntries(series, all);
  SvgFrame frame;
  FitRight(entries, &frame);
  FitLeft(PlotAxes(frame, all, true, labels.share).y.texts(), &frame);
  const PlotAxes axes(frame, all, true, labels.share);
  std::string svg = OpenSvg(frame, labels) + SvgGrid(frame, axes.x, axes.y) +
                    AxisLabels(frame, labels) + Legend(frame, entries);
  for (size_t i = 0; i < series.size(); ++i) {
    std::vector<std::optional<std::pair<double, double>>> places;
    std::string marks;
    for (const ChartPoint& point : series[i].points) {
      const double x = axes.x(point.x);
      places.emplace_back();
      if (point.fallen) {
        marks += FallenMark(x, axes.strip, point.tip);
      } else if (point.untold) {
        marks += UntoldMark(x, axes.strip, point.tip);
      } else if (point.y && std::isfinite(*point.y)) {
        places.back() = {x, axes.y(*point.y)};
        marks += Dot(x, axes.y(*point.y), i, point.tip);
      }
    }
    svg += fmt::format("<path d='{}' {}/>", Path(places), SeriesLine(i)) + marks;
  }
  return svg + "</svg>";
}

std::string PointChart(const ChartLabels& labels, const std::vector<ChartPoint>& points) {
  std::vector<LegendEntry> entries = {SwatchEntry(SeriesFill(0), "stands")};
  if (AnyFell(points)) entries.push_back(FallenEntry());
  if (AnyUntold(points)) entries.push_back(UntoldEntry());
  SvgFrame frame;
  FitRight(entries, &frame);
  FitLeft(PlotAxes(frame, points, false, labels.share).y.texts(), &frame);
  const PlotAxes axes(frame, points, false, labels.share);
  std::string svg = OpenSvg(frame, labels) + SvgGrid(frame, axes.x, axes.y) +
                    AxisLabels(frame, labels) + Legend(frame, entries);
  for (const ChartPoint& point : points) {
    if (point.fallen) {
      svg += FallenMark(axes.x(point.x), axes.strip, point.tip);
    } else if (point.untold) {
      svg += UntoldMark(axes.x(point.x), axes.strip, point.tip);
    } else if (point.y && std::isfinite(*point.y)) {
      svg += Dot(axes.x(point.x), axes.y(*point.y), 0, point.tip);
    }
  }
  return svg + "</svg>";
}

std::string PolarChart(const ChartLabels& labels, const std::vector<ChartSeries>& series) {
  const std::vector<ChartPoint> all = AllPoints(series);
  const std::vector<LegendEntry> entries = SeriesEntries(series, all);
  SvgFrame frame;
  FitRight(entries, &frame);
  const double most = labels.share ? 1 : std::max(Range(all, YOf).second, 1e-12);
  const SvgAxis radius(0, most, 0, SvgFrame::radius());
  std::string svg = OpenSvg(frame, labels) + Spokes(frame) + Legend(frame, entries);
  const std::vector<std::string> texts = radius.texts();
  for (size_t i = 1; i < texts.size(); ++i) {
    const double r = radius(radius.ticks()[i]);
    svg += fmt::format("<circle class='g' cx='{:.1f}' cy='{:.1f}' r='{:.1f}' fill='none'/>",
                       frame.center_x(), SvgFrame::center_y(), r);
    svg += SvgText(frame.center_x() + 3, SvgFrame::center_y() - r + 10, texts[i], "start",
                   " class='r'");
  }
  for (size_t i = 0; i < series.size(); ++i) {
    std::vector<std::optional<std::pair<double, double>>> places;
    std::string marks;
    for (const ChartPoint& point : series[i].points) {
      places.emplace_back();
      if (point.fallen || point.untold) {
        const auto [x, y] = PolarPlace(frame, point.x, SvgFrame::radius() + 8);
        marks += point.fallen ? FallenMark(x, y, point.tip) : UntoldMark(x, y, point.tip);
      } else if (point.y && std::isfinite(*point.y)) {
        places.back() = PolarPlace(frame, point.x, radius(std::max(0.0, *point.y)));
        marks += Dot(places.back()->first, places.back()->second, i, point.tip);
      }
    }
    const bool closed = std::ranges::all_of(places, [](const auto& place) { return !!place; });
    svg += fmt::format("<path d='{}{}' {}/>", Path(places), closed && !places.empty() ? " Z" : "",
                       SeriesLine(i)) +
           marks;
  }
  return svg +
         SvgText(frame.center_x(), SvgFrame::height() - 6,
                 fmt::format("{}; outwards: {}", labels.x, labels.y), "middle") +
         "</svg>";
}

std::string HeatMap(const ChartLabels& labels, const std::vector<std::string>& columns,
                    const std::vector<std::string>& rows, const std::vector<ChartCell>& cells,
                    const ChartScale& scale) {
  SvgFrame frame;
  FitLeft(rows, &frame);
  const double width = kPlotWidth / static_cast<double>(columns.size());
  const double height = kPlotHeight / static_cast<double>(rows.size());
  std::string svg =
      OpenSvg(frame, labels) + AxisLabels(frame, labels) +
      ScaleLegend(frame, cells, scale, labels.unit, SwatchEntry("class='ff'", "none stands"));
  for (const ChartCell& cell : cells) {
    const double x = frame.left + cell.x * width, y = kBase - (cell.y + 1) * height;
    svg += fmt::format("<rect x='{:.2f}' y='{:.2f}' width='{:.2f}' height='{:.2f}' {}>{}</rect>", x,
                       y, width + 0.2, height + 0.2, CellFill(cell, scale), SvgTip(cell.tip));
    if (cell.some_fallen) svg += FallenMark(x + width / 2, y + height / 2, cell.tip);
    if (cell.untold) svg += UntoldMark(x + width / 2, y + height / 2, cell.tip);
  }
  std::vector<std::pair<double, std::string>> below, beside;
  for (size_t i = 0; i < columns.size(); ++i) {
    below.emplace_back(frame.left + (static_cast<double>(i) + 0.5) * width, columns[i]);
  }
  for (size_t i = 0; i < rows.size(); ++i) {
    beside.emplace_back(kBase - (static_cast<double>(i) + 0.5) * height, rows[i]);
  }
  return svg + TextsBelow(below, kBase + 16) + TextsBeside(beside, frame.left - 6) + "</svg>";
}

std::string PolarHeatMap(const ChartLabels& labels, const std::vector<double>& angles,
                         const std::vector<std::string>& rows, const std::vector<ChartCell>& cells,
                         const ChartScale& scale) {
  double spread = 360;  // degrees a cell takes
  for (size_t i = 1; i < angles.size(); ++i) {
    spread = std::min(spread, std::abs(angles[i] - angles[i - 1]));
  }
  spread = std::min(std::max(spread, 0.1), 359.99);
  const SvgFrame frame;
  const double ring = SvgFrame::radius() / (static_cast<double>(rows.size()) + 0.5);
  std::string svg = OpenSvg(frame, labels) + ScaleLegend(frame, cells, scale, labels.unit,
                                                         SwatchEntry("class='ff'", "none stands"));
  for (const ChartCell& cell : cells) {
    const double inner = (cell.y + 0.5) * ring, outer = inner + ring;
    const double begin = cell.x - spread / 2, end = cell.x + spread / 2;
    const auto [ax, ay] = PolarPlace(frame, begin, inner);
    const auto [bx, by] = PolarPlace(frame, begin, outer);
    const auto [cx, cy] = PolarPlace(frame, end, outer);
    const auto [dx, dy] = PolarPlace(frame, end, inner);
    const int large = spread > 180 ? 1 : 0;
    svg += fmt::format(
        "<path d='M{:.2f} {:.2f} L{:.2f} {:.2f} A{:.2f} {:.2f} 0 {} 0 {:.2f} {:.2f} "
        "L{:.2f} {:.2f} A{:.2f} {:.2f} 0 {} 1 {:.2f} {:.2f} Z' {}>{}</path>",
        ax, ay, bx, by, outer, outer, large, cx, cy, dx, dy, inner, inner, large, ax, ay,
        CellFill(cell, scale), SvgTip(cell.tip));
    const auto [x, y] = PolarPlace(frame, cell.x, (inner + outer) / 2);
    if (cell.some_fallen) svg += FallenMark(x, y, cell.tip);
    if (cell.untold) svg += UntoldMark(x, y, cell.tip);
  }
  svg += Spokes(frame);
  double free = SvgFrame::center_y() + 1e9;
  for (size_t i = 0; i < rows.size(); ++i) {
    const double y = SvgFrame::center_y() - (static_cast<double>(i) + 1) * ring + 4;
    if (y > free) continue;
    svg += SvgText(frame.center_x() + 3, y, rows[i], "start", " class='r h'");
    free = y - 24;
  }
  return svg +
         SvgText(frame.center_x(), SvgFrame::height() - 6,
                 fmt::format("{}; outwards: {}", labels.x, labels.y), "middle") +
         "</svg>";
}

std::string ScatterChart(const ChartLabels& labels, const std::vector<ChartCell>& cells,
                         const ChartScale& scale) {
  const auto [left, right] = Range(cells, [](const ChartCell& c) { return std::optional(c.x); });
  const auto [low, high] = Range(cells, [](const ChartCell& c) { return std::optional(c.y); });
  SvgFrame frame;
  const SvgAxis y(low, high, kBase, kTop);
  FitLeft(y.texts(), &frame);
  const SvgAxis x(left, right, frame.left, frame.right_edge());
  std::string svg = OpenSvg(frame, labels) + SvgGrid(frame, x, y) + AxisLabels(frame, labels) +
                    ScaleLegend(frame, cells, scale, labels.unit, FallenEntry());
  // The rare ones, which are those of low share, on top.
  std::vector<const ChartCell*> order;
  for (const ChartCell& cell : cells) order.push_back(&cell);
  std::stable_sort(order.begin(), order.end(), [](const ChartCell* a, const ChartCell* b) {
    return a->value.value_or(INFINITY) > b->value.value_or(INFINITY);
  });
  for (const ChartCell* cell : order) {
    if (cell->fallen || cell->untold) {
      svg += cell->fallen ? FallenMark(x(cell->x), y(cell->y), cell->tip)
                          : UntoldMark(x(cell->x), y(cell->y), cell->tip);
      continue;
    }
    svg += fmt::format("<circle class='o' cx='{:.1f}' cy='{:.1f}' r='4' fill='{}'>{}</circle>",
                       x(cell->x), y(cell->y), scale.Colour(cell->value), SvgTip(cell->tip));
  }
  return svg + "</svg>";
}

std::string ChartStyle(bool dark) {
  // Okabe and Ito's colours: told apart by colour-blind readers too.
  constexpr std::array kLight = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                 "#e69f00", "#56b4e9", "#000000", "#b0a000"};
  constexpr std::array kDark = {"#4db2ff", "#ff8c42", "#2ecc9a", "#e59ac6",
                                "#f5b82e", "#8fd0f5", "#f2f2f2", "#e0d24a"};
  const auto series = [](const auto& colours) {
    std::string css;
    for (size_t i = 0; i < colours.size(); ++i) {
      css += fmt::format(
          ".s{0}{{fill:{1}}} .l{0}{{fill:none;stroke:{1};stroke-width:1;stroke-dasharray:2 5}}\n",
          i, colours[i]);
    }
    return css;
  };
  std::string css =
      "text{font:11px system-ui,sans-serif;fill:#333} .t{font-size:13px;font-weight:600}\n"
      ".r{fill:#555;font-size:10px} .h{paint-order:stroke;stroke:#fff;stroke-width:3px}\n"
      ".g{stroke:#ddd;stroke-width:1} .o{fill-opacity:.85;stroke:#333;stroke-width:.4}\n"
      ".u{fill:none;stroke:#777;stroke-width:2;stroke-dasharray:3 2}\n"
      ".f{fill:none;stroke:#c81e1e;stroke-width:2} .ff{fill:#e9b4b4;stroke:#c81e1e;"
      "stroke-width:.5}\n" +
      series(kLight);
  if (dark) {
    css +=
        "@media(prefers-color-scheme:dark){text{fill:#dfe3ea} .r{fill:#b8c0cc}\n"
        ".h{stroke:#1a1e25} .g{stroke:#3a4350} .o{stroke:#ddd}\n"
        ".f{stroke:#ff7b7b} .ff{fill:#5a2a2e;stroke:#ff7b7b}\n" +
        series(kDark) + "}\n";
  }
  return css;
}

std::string StandaloneSvg(const std::string& chart) {
  constexpr std::string_view kOpening = "<svg ", kViewBox = "viewBox='0 0 ";
  const size_t content = chart.find('>') + 1;
  const size_t size = chart.find(kViewBox) + kViewBox.size();
  const size_t space = chart.find(' ', size), end = chart.find('\'', space);
  return fmt::format(
      "{}xmlns='http://www.w3.org/2000/svg' width='{}' height='{}' {}<style>{}</style>"
      "<rect width='100%' height='100%' fill='#fff'/>{}\n",
      kOpening, chart.substr(size, space - size), chart.substr(space + 1, end - space - 1),
      chart.substr(kOpening.size(), content - kOpening.size()), ChartStyle(false),
      chart.substr(content));
}

}  // namespace poise
