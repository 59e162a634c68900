#include "tools/maps/svg_frame.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "fmt/format.h"
#include "tools/cli/text_table.h"

namespace poise {
namespace {

constexpr double kCharacter = 6.3;       // pixels of 11 px sans-serif, the mean of its wide letters
constexpr double kTitleCharacter = 8.4;  // of 13 px, bold
constexpr double kGap = 6;               // between texts
constexpr double kLine = 14;             // between lines of texts
constexpr double kLegendLine = 18;
constexpr double kLegendMark = 26;  // from the plot's edge to a legend's text
constexpr double kMostLeft = 190, kMostRight = 260;
constexpr size_t kNumSeries = 8;  // colours in ChartStyle
constexpr size_t kMostEntries = 17;

size_t NumCharacters(std::string_view text) {
  return static_cast<size_t>(
      std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
}

double Widest(const std::vector<std::string>& texts) {
  double widest = 0;
  for (const std::string& text : texts) widest = std::max(widest, TextWidth(text));
  return widest;
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

/// The title in lines that fit, at a space; the second one may be cut.
std::vector<std::string> TitleLines(const std::string& title, double width) {
  const auto most = static_cast<size_t>(width / kTitleCharacter);
  if (NumCharacters(title) <= most) return {title};
  size_t split = title.rfind(' ', most);
  if (split == std::string::npos || split == 0) split = title.find(' ');
  if (split == std::string::npos) return {title};
  return {title.substr(0, split),
          Shortened(title.substr(split + 1), width * kCharacter / kTitleCharacter)};
}

}  // namespace

double TextWidth(std::string_view text) {
  return kCharacter * static_cast<double>(NumCharacters(text));
}

std::string Shortened(const std::string& text, double width) {
  if (TextWidth(text) <= width) return text;
  auto most = static_cast<ptrdiff_t>(width / kCharacter) - 1;
  std::string cut;
  for (const char c : text) {
    if ((c & 0xC0) != 0x80 && --most < 0) break;
    cut += c;
  }
  return cut + "…";
}

void FitLeft(const std::vector<std::string>& texts, SvgFrame* frame) {
  frame->left = std::clamp(Widest(texts) + 32, frame->left, kMostLeft);
}

void FitRight(const std::vector<std::string>& texts, SvgFrame* frame) {
  frame->right = std::clamp(Widest(texts) + kLegendMark + 8, frame->right, kMostRight);
}

std::string SvgTip(const std::string& text) { return "<title>" + HtmlText(text) + "</title>"; }

std::string SvgText(double x, double y, const std::string& text, const char* anchor,
                    const std::string& more) {
  return fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='{}'{}>{}</text>", x, y, anchor, more,
                     HtmlText(text));
}

std::string OpenSvg(const SvgFrame& frame, const ChartLabels& labels) {
  std::string svg = fmt::format("<svg viewBox='0 0 {:.0f} {:.0f}' role='img' aria-label='{}'>",
                                frame.width(), SvgFrame::height(), HtmlText(labels.title));
  double y = 18;
  for (const std::string& line : TitleLines(labels.title, frame.width() - 24)) {
    svg += SvgText(12, y, line, "start", " class='t'");
    y += 16;
  }
  return svg;
}

std::string AxisLabels(const SvgFrame& frame, const ChartLabels& labels) {
  return SvgText(frame.center_x(), SvgFrame::height() - 12, labels.x, "middle") +
         SvgText(14, SvgFrame::center_y(), Shortened(labels.y, SvgFrame::kPlotHeight), "middle",
                 fmt::format(" transform='rotate(-90 14 {:.1f})'", SvgFrame::center_y()));
}

SvgAxis::SvgAxis(double low, double high, double from_pixel, double to_pixel)
    : ticks_(Ticks(low, high)), from_(from_pixel), to_(to_pixel) {}

double SvgAxis::operator()(double value) const {
  return from_ + (value - ticks_.front()) / (ticks_.back() - ticks_.front()) * (to_ - from_);
}

std::vector<std::string> SvgAxis::texts() const {
  std::vector<std::string> texts;
  const double least = 1e-9 * (ticks_.back() - ticks_.front());
  for (const double tick : ticks_) texts.push_back(FormatNumber(std::abs(tick) < least ? 0 : tick));
  return texts;
}

std::string TextsBelow(const std::vector<std::pair<double, std::string>>& texts, double y) {
  std::string svg;
  double free = -1e9;
  for (const auto& [x, text] : texts) {
    const double half = TextWidth(text) / 2;
    if (x - half < free) continue;
    svg += SvgText(x, y, text, "middle");
    free = x + half + kGap;
  }
  return svg;
}

std::string TextsBeside(const std::vector<std::pair<double, std::string>>& texts, double x) {
  std::string svg;
  double free = 1e9;  // upwards
  for (const auto& [y, text] : texts) {
    if (y > free) continue;
    svg += SvgText(x, y + 4, Shortened(text, kMostLeft - 32), "end");
    free = y - kLine;
  }
  return svg;
}

std::string SvgGrid(const SvgFrame& frame, const SvgAxis& x, const SvgAxis& y) {
  constexpr double kBase = SvgFrame::kTop + SvgFrame::kPlotHeight;
  std::string svg;
  std::vector<std::pair<double, std::string>> below, beside;
  const std::vector<std::string> x_texts = x.texts(), y_texts = y.texts();
  for (size_t i = 0; i < x.ticks().size(); ++i) {
    const double at = x(x.ticks()[i]);
    svg += fmt::format("<path class='g' d='M{0:.1f} {1} V{2}'/>", at, SvgFrame::kTop, kBase);
    below.emplace_back(at, x_texts[i]);
  }
  for (size_t i = 0; i < y.ticks().size(); ++i) {
    const double at = y(y.ticks()[i]);
    svg +=
        fmt::format("<path class='g' d='M{1} {0:.1f} H{2}'/>", at, frame.left, frame.right_edge());
    beside.emplace_back(at, y_texts[i]);
  }
  return svg + TextsBelow(below, kBase + 16) + TextsBeside(beside, frame.left - 6);
}

std::string SeriesFill(size_t series) { return fmt::format("class='s{}'", series % kNumSeries); }
std::string SeriesLine(size_t series) { return fmt::format("class='l{}'", series % kNumSeries); }

LegendEntry SwatchEntry(const std::string& attributes, const std::string& text) {
  return {fmt::format("<rect x='-6' y='-6' width='12' height='12' {}/>", attributes), text};
}

LegendEntry FallenEntry() { return {FallenMark(0, 0, ""), "did not stand"}; }

std::string Legend(const SvgFrame& frame, const std::vector<LegendEntry>& entries) {
  std::string svg;
  double y = SvgFrame::kTop + 8;
  for (size_t i = 0; i < entries.size(); ++i, y += kLegendLine) {
    if (i + 1 == kMostEntries && entries.size() > kMostEntries) {
      svg += SvgText(frame.right_edge() + kLegendMark, y + 4,
                     fmt::format("and {} more", entries.size() - i), "start");
      break;
    }
    svg += fmt::format("<g transform='translate({:.1f} {:.1f})'>{}</g>", frame.right_edge() + 16, y,
                       entries[i].svg_mark);
    svg += SvgText(frame.right_edge() + kLegendMark, y + 4,
                   Shortened(entries[i].text, frame.right - kLegendMark - 4), "start");
  }
  return svg;
}

std::string FallenMark(double x, double y, const std::string& tip) {
  return fmt::format("<path class='f' d='M{:.1f} {:.1f} l7 7 m0 -7 l-7 7'>{}</path>", x - 3.5,
                     y - 3.5, tip.empty() ? "" : SvgTip(tip));
}

std::string UntoldMark(double x, double y, const std::string& tip) {
  return fmt::format("<circle class='u' cx='{:.1f}' cy='{:.1f}' r='4'>{}</circle>", x, y,
                     tip.empty() ? "" : SvgTip(tip));
}

LegendEntry UntoldEntry() { return {UntoldMark(0, 0, ""), "does not tell"}; }

std::string ColourBar(const SvgFrame& frame, const ChartScale& scale, const std::string& unit,
                      const std::vector<LegendEntry>& above) {
  std::string svg;
  constexpr int kSteps = 40;
  const double room = kLegendLine * static_cast<double>(above.size());
  const double x = frame.right_edge() + 14, height = SvgFrame::kPlotHeight - 42 - room;
  const double top = SvgFrame::kTop + 22 + room;
  const auto value = [&](double share) { return scale.low + share * (scale.high - scale.low); };
  for (int i = 0; i < kSteps; ++i) {
    svg += fmt::format("<rect x='{:.1f}' y='{:.1f}' width='14' height='{:.2f}' fill='{}'/>", x,
                       top + height * (1 - static_cast<double>(i + 1) / kSteps),
                       height / kSteps + 0.3, scale.Colour(value((i + 0.5) / kSteps)));
  }
  for (const double share : {0.0, 0.5, 1.0}) {
    svg += SvgText(x + 18, top + 4 + height * (1 - share), FormatNumber(value(share)), "start");
  }
  return svg + Legend(frame, above) + SvgText(x, top - 8, unit, "start");
}

}  // namespace poise
