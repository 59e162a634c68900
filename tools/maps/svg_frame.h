// The parts that charts share: the room around a plot, axes, texts that do not overlap, legends.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/maps/sweep_charts.h"

namespace poise {

/// Pixels. The plot is of one size; the room around it grows with what stands there.
struct SvgFrame {
  static constexpr double kPlotWidth = 370, kPlotHeight = 338, kTop = 50, kBottom = 52;
  static constexpr double kStrip = 22;  ///< above the plot, of what fell
  double left = 70, right = 120;

  double width() const { return left + kPlotWidth + right; }
  static constexpr double height() { return kTop + kPlotHeight + kBottom; }
  double center_x() const { return left + kPlotWidth / 2; }
  static constexpr double center_y() { return kTop + kPlotHeight / 2; }
  static constexpr double radius() { return kPlotHeight / 2 - 14; }
  double right_edge() const { return left + kPlotWidth; }
};

/// Room on the left for texts of an axis.
void FitLeft(const std::vector<std::string>& texts, SvgFrame* frame);
/// Room on the right for a legend's texts.
void FitRight(const std::vector<std::string>& texts, SvgFrame* frame);

/// Pixels that a text takes, nearly.
double TextWidth(std::string_view text);

/// `text` as it is, or cut to `width` pixels with an ellipsis.
std::string Shortened(const std::string& text, double width);

/// anchor: "start", "middle" or "end"; `more`: attributes.
std::string SvgText(double x, double y, const std::string& text, const char* anchor,
                    const std::string& more = "");

/// <svg ...> with the title in up to two lines.
std::string OpenSvg(const SvgFrame& frame, const ChartLabels& labels);
std::string AxisLabels(const SvgFrame& frame, const ChartLabels& labels);

/// A linear axis over data with round ticks: pixel = axis(value).
class SvgAxis {
 public:
  SvgAxis(double low, double high, double from_pixel, double to_pixel);
  double operator()(double value) const;
  const std::vector<double>& ticks() const { return ticks_; }
  std::vector<std::string> texts() const;

 private:
  std::vector<double> ticks_;
  double from_, to_;
};

/// Lines and texts of both axes.
std::string SvgGrid(const SvgFrame& frame, const SvgAxis& x, const SvgAxis& y);

/// Texts at places along a horizontal or vertical line, those left out that would overlap others.
std::string TextsBelow(const std::vector<std::pair<double, std::string>>& texts, double y);
std::string TextsBeside(const std::vector<std::pair<double, std::string>>& texts, double x);

/// CSS classes of a series' marks and lines.
std::string SeriesFill(size_t series);
std::string SeriesLine(size_t series);

struct LegendEntry {
  std::string svg_mark;  ///< drawn around (0, 0)
  std::string text;
};
std::string Legend(const SvgFrame& frame, const std::vector<LegendEntry>& entries);
LegendEntry SwatchEntry(const std::string& attributes, const std::string& text);
LegendEntry FallenEntry();

/// A cross, the mark of what fell.
std::string FallenMark(double x, double y, const std::string& tip);

/// A broken ring, the mark of a run that does not tell whether the robot stood.
std::string UntoldMark(double x, double y, const std::string& tip);
LegendEntry UntoldEntry();

/// `above`: what has another mark than a colour of the scale.
std::string ColourBar(const SvgFrame& frame, const ChartScale& scale, const std::string& unit,
                      const std::vector<LegendEntry>& above);

std::string SvgTip(const std::string& text);

}  // namespace poise
