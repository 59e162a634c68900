// Charts as inline SVG, for pages that open without a network.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace poise {

/// `text` for HTML and SVG.
std::string HtmlText(const std::string& text);

struct ChartLabels {
  std::string title, x, y, value;
};

/// A curve: points in the order in which they are joined.
struct ChartSeries {
  std::string name;
  std::vector<std::pair<double, double>> points;
};

/// A coloured place. `tip`: what it says under the mouse.
struct ChartCell {
  double x = 0, y = 0;
  std::optional<double> value;
  std::string tip;
};

/// Colours of values: from low to high, or of shares from 0 (orange: none stands) to 1 (blue).
struct ChartScale {
  double low = 0, high = 1;
  bool share = false;
  std::string Colour(const std::optional<double>& value) const;
};
/// Of the values that there are.
ChartScale ScaleOf(const std::vector<ChartCell>& cells, bool share);

std::string CurveChart(const ChartLabels& labels, const std::vector<ChartSeries>& series);
/// x is an angle in degrees, 0 up (the world's x) and counter-clockwise (to its y); y the distance
/// from the centre, 0 or more. Curves close.
std::string PolarChart(const ChartLabels& labels, const std::vector<ChartSeries>& series);
/// x and y of a cell are indexes of `columns` and `rows`, the values' texts; row 0 is at the
/// bottom.
std::string HeatMap(const ChartLabels& labels, const std::vector<std::string>& columns,
                    const std::vector<std::string>& rows, const std::vector<ChartCell>& cells,
                    const ChartScale& scale);
/// x: angles as in PolarChart, in degrees; y: indexes of `rows`, the innermost first.
std::string PolarHeatMap(const ChartLabels& labels, const std::vector<double>& angles,
                         const std::vector<std::string>& rows, const std::vector<ChartCell>& cells,
                         const ChartScale& scale);
std::string ScatterChart(const ChartLabels& labels, const std::vector<ChartCell>& cells,
                         const ChartScale& scale);

/// A chart of the above as a file of its own, without a page's style around it.
std::string StandaloneSvg(const std::string& chart);

/// A whole page: a heading, paragraphs, charts.
std::string ChartPage(const std::string& title, const std::vector<std::string>& paragraphs,
                      const std::vector<std::string>& charts);

}  // namespace poise
