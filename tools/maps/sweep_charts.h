// Charts as inline SVG, for pages that open without a network.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace poise {

/// `text` for HTML and SVG.
std::string HtmlText(std::string_view text);

/// title: what is shown, in words; x, y: the axes with their units; unit: of the values; share: the
/// values are shares, whose axis is 0 to 1.
struct ChartLabels {
  std::string title, x, y, unit;
  bool share = false;
};

/// `fallen`: of a run that did not stand, `untold`: of one that does not tell. Each has a mark of
/// its own and no part in an axis' range.
struct ChartPoint {
  double x = 0;
  std::optional<double> y;
  std::string tip;  ///< what it says under the mouse
  bool fallen = false, untold = false;
};

/// A curve: points in the order in which a dashed line guides the eye, since nothing is known
/// between them; what fell interrupts it.
struct ChartSeries {
  std::string name;
  std::vector<ChartPoint> points;
};

/// A coloured place.
struct ChartCell {
  double x = 0, y = 0;
  std::optional<double> value;
  std::string tip;
  bool fallen = false;       ///< none of its runs stands: no value of the scale
  bool some_fallen = false;  ///< the value is of those that stand
  bool untold = false;       ///< none of its runs tells
};

/// Colours of values: from low to high, or of shares from 0 (orange: none stands) to 1 (blue).
struct ChartScale {
  double low = 0, high = 1;
  bool share = false;
  std::string Colour(const std::optional<double>& value) const;
};
/// Makes the scale of the values that there are; what fell is off the scale.
ChartScale ScaleOf(const std::vector<ChartCell>& cells, bool share);

/// What fell stands in a strip above the plot.
std::string CurveChart(const ChartLabels& labels, const std::vector<ChartSeries>& series);
/// Points that are not joined, in two colours: what stands, and what fell in a strip above them.
std::string PointChart(const ChartLabels& labels, const std::vector<ChartPoint>& points);
/// x is an angle in degrees, 0 up (the world's x) and counter-clockwise (to its y); y the distance
/// from the centre, 0 or more. Curves close. What fell stands outside.
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

/// The style of all charts, light; with `dark` also what changes where the reader prefers dark.
std::string ChartStyle(bool dark);

/// A chart of the above as a file of its own, light, without a page's style around it.
std::string StandaloneSvg(const std::string& chart);

}  // namespace poise
