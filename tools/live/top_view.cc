#include "tools/live/top_view.h"

#include <algorithm>
#include <limits>

#include "components/framework/run.h"
#include "fmt/format.h"
#include "logging/events/bridge_words.h"
#include "logging/events/code_names.h"
#include "logging/printable.h"
#include "tools/cli/text_table.h"
#include "tools/report/report.h"

namespace poise {
namespace {

using Style = ViewLine::Style;

constexpr double kStale = 1;  // s without a report of health, of which there are some a second
constexpr char kNothing[] = "-";

/// "-" for what is not known (negative).
std::string Number(double value, int digits) {
  return value < 0 ? kNothing : fmt::format("{:.{}f}", value, digits);
}

std::string Count(int64_t value) { return value < 0 ? kNothing : fmt::format("{}", value); }

std::string Rate(double bytes_per_second) {
  return bytes_per_second < 1e6 ? fmt::format("{:.1f} kB/s", bytes_per_second * 1e-3)
                                : fmt::format("{:.2f} MB/s", bytes_per_second * 1e-6);
}

constexpr logging::CodeName kStates[] = {
    {health_t::STATE_STARTING, "starting"}, {health_t::STATE_READY, "ready"},
    {health_t::STATE_RUNNING, "running"},   {health_t::STATE_FINISHED, "finished"},
    {health_t::STATE_FAILED, "FAILED"},
};

std::string StateName(int8_t state) { return logging::NameOf(kStates, state, "state"); }

void AddHeader(const RunSpec& spec, const logging::ElementNames& names, const std::string& dir,
               const LiveSnapshot& snapshot, int64_t refused, std::vector<ViewLine>* lines) {
  const double period = spec.tick_period();
  lines->push_back({fmt::format("{}  run {}  {}", spec.scenario(), spec.run_id(), dir)});
  const auto seconds = [period](int64_t ticks) { return static_cast<double>(ticks) * period; };
  std::string progress = fmt::format("tick {}", Count(snapshot.tick));
  if (spec.num_ticks() > 0) progress += fmt::format(" of {}", spec.num_ticks());
  if (snapshot.tick >= 0) {
    progress += fmt::format("  {:.3f} s", seconds(snapshot.tick - spec.lead_ticks()));
  }
  if (spec.num_ticks() > 0) {
    progress += fmt::format(" of {:.6g} s", seconds(spec.num_ticks() - spec.lead_ticks()));
  }
  if (spec.lead_ticks() > 0) {
    progress += fmt::format(", after {:.6g} s of lead", seconds(spec.lead_ticks()));
  }
  lines->push_back({progress});
  progress.clear();
  if (snapshot.tick_rate >= 0) {
    progress = fmt::format("{:.1f} ticks/s  {:.2f} x real time  ", snapshot.tick_rate,
                           snapshot.tick_rate * period);
  }
  progress += spec.realtime() ? "paced by the wall clock" : "as fast as it goes";
  const bool stopped = snapshot.bridge && snapshot.bridge->state >= bridge_status_t::STATE_STOPPING;
  const bool failing = snapshot.bridge && snapshot.bridge->state > bridge_status_t::STATE_RUNNING;
  if (snapshot.bridge) {
    progress += "  bridge: " + logging::BridgeStateName(snapshot.bridge->state);
    const std::string reason = logging::BridgeReasonText(*snapshot.bridge, names);
    if (!reason.empty()) progress += ", " + reason;
  }
  lines->push_back({progress, stopped   ? Style::kFailure
                              : failing ? Style::kWarning
                                        : Style::kPlain});
  lines->push_back({fmt::format("{}  refused here: {} packets", MirrorUrl(spec), refused),
                    refused > 0 ? Style::kWarning : Style::kPlain});
}

/// What only real time brings about, where there is any of it.
void AddRealTime(const health_t& h, std::vector<ViewLine>* lines) {
  std::vector<std::string> parts;
  if (h.lateness_max > 0) parts.push_back(fmt::format("at most {:.1f} us late", h.lateness_max));
  if (h.ticks_skipped > 0) parts.push_back(fmt::format("{} ticks skipped", h.ticks_skipped));
  if (h.restarts > 0) parts.push_back(fmt::format("restarted {} times", h.restarts));
  const std::vector<std::string> granted = SchedulingNames(h.scheduling);
  if (!granted.empty()) parts.push_back("scheduling: " + Joined(granted, ", "));
  if (parts.empty()) return;
  const bool odd = h.ticks_skipped > 0 || h.restarts > 0;
  lines->push_back({"  " + Joined(parts, "; "), odd ? Style::kWarning : Style::kPlain});
}

/// "controller/state_estimator" for a component that shares a process.
std::string ProcessLabel(const RunSpec& spec, const std::string& component) {
  for (const ComponentInstance& instance : spec.graph().component()) {
    const std::string& process = ProcessOf(instance);
    if (instance.name() != component || process == component) continue;
    return process + "/" + component;
  }
  return component;
}

/// Cells with a space between them, in columns of `widths`; below 0: to the left.
ViewLine Row(const std::vector<int>& widths, const std::vector<std::string>& cells, Style style) {
  ViewLine line{"", style};
  for (size_t i = 0; i < cells.size(); ++i) {
    if (i > 0) line.text += ' ';
    line.text += widths[i] < 0 ? fmt::format("{:<{}}", cells[i], -widths[i])
                               : fmt::format("{:>{}}", cells[i], widths[i]);
    line.ends.push_back(line.text.size());
  }
  return line;
}

void AddProcesses(const RunSpec& spec, const LiveSnapshot& snapshot, std::vector<ViewLine>* lines) {
  size_t width = 7;
  for (const auto& process : snapshot.processes) {
    width = std::max(width, ProcessLabel(spec, process.name).size());
  }
  const std::vector<int> widths = {
      -static_cast<int>(width), -8, 7, 6, 4, 4, 7, 7, 6, 6, 5, 6, 9, 6};
  lines->push_back(Row(widths,
                       {"PROCESS", "STATE", "TICKS/S", "P99 us", "LATE", "GAPS", "REFUSED",
                        "DROPPED", "RESENT", "UNSENT", "AGE s", "TICK", "MEDIAN us", "MAX us"},
                       Style::kTitle));
  for (const auto& process : snapshot.processes) {
    const std::string name = ProcessLabel(spec, process.name);
    if (!process.seen) {
      lines->push_back(Row(widths, {name, "not heard of"}, Style::kWarning));
      continue;
    }
    const health_t& h = process.health;
    const bool timed = h.latency_max > 0;  // the recorder answers no one
    const bool failed = h.state == health_t::STATE_FAILED;
    const bool stale = process.age > kStale && h.state <= health_t::STATE_RUNNING;
    lines->push_back(
        Row(widths,
            {name, StateName(h.state), Number(process.tick_rate, 1),
             Number(timed ? h.latency_p99 : -1, 0), Count(h.deadline_misses), Count(h.gaps),
             Count(h.messages_refused), Count(h.messages_dropped), Count(h.resends),
             Count(h.publish_errors), Number(process.age, 1), Count(h.tick),
             Number(timed ? h.latency_median : -1, 0), Number(timed ? h.latency_max : -1, 0)},
            failed                           ? Style::kFailure
            : stale || h.deadline_misses > 0 ? Style::kWarning
                                             : Style::kPlain));
    AddRealTime(h, lines);
    if (!h.detail.empty()) {
      lines->push_back({fmt::format("  {}", logging::Printable(h.detail)),
                        failed ? Style::kFailure : Style::kPlain});
    }
  }
}

/// A line for each slave of the drives' bus.
void AddBus(const bus_status_t& bus, std::vector<ViewLine>* lines) {
  constexpr int kOperational = 8, kError = 16;
  const std::vector<int> widths = {-5, -22, 7, 9, 9, 10, 9, 10, 10};
  lines->push_back(Row(widths,
                       {"SLAVE", "STATE", "603F", "EMERGENCY", "COUNT", "CLOCK ns", "RX ERR",
                        "LOST LINK", "RECOVERED"},
                       Style::kTitle));
  for (size_t i = 0; i < bus.online.size(); ++i) {
    const int status = bus.al_status[i];
    const char* const name = (status & 15) == 1   ? "INIT"
                             : (status & 15) == 2 ? "PRE-OP"
                             : (status & 15) == 4 ? "SAFE-OP"
                             : (status & 15) == 8 ? "OP"
                                                  : "unknown";
    std::string state = bus.online[i] == 0 ? "does not answer" : name;
    if (bus.online[i] != 0 && (status & kError) != 0) {
      state += fmt::format(", error {:04X}", bus.al_code[i]);
    }
    const bool good = bus.online[i] != 0 && status == kOperational;
    const bool odd = bus.error_code[i] != 0 || bus.receive_errors[i] != 0;
    lines->push_back(
        Row(widths,
            {Count(static_cast<int64_t>(i)), state, fmt::format("{:04X}", bus.error_code[i]),
             fmt::format("{:04X}", bus.emergency[i]), fmt::format("{}", bus.emergencies[i]),
             fmt::format("{}", bus.clock_difference[i]), fmt::format("{}", bus.receive_errors[i]),
             fmt::format("{}", bus.lost_links[i]), fmt::format("{}", bus.recoveries[i])},
            !good ? Style::kFailure
            : odd ? Style::kWarning
                  : Style::kPlain));
  }
}

void AddChannels(const LiveSnapshot& snapshot, std::vector<ViewLine>* lines) {
  size_t name = 7;
  for (const auto& channel : snapshot.channels) name = std::max(name, channel.name.size());
  const std::vector<int> widths = {-static_cast<int>(name), 9, 7, 7, 11, 7, 8, 0};
  lines->push_back(Row(widths,
                       {"CHANNEL", "MSG/S", "AGE s", "MISSED", "DATA", "B/MSG", "TICK", "TYPE"},
                       Style::kTitle));
  double bytes = 0;
  double rate = 0;
  for (const auto& channel : snapshot.channels) {
    bytes += channel.bytes_per_second;
    rate += channel.rate;
    lines->push_back(Row(
        widths,
        {channel.name, Number(channel.rate, 1), Number(channel.age, 2),
         fmt::format("{}", channel.missed), Rate(channel.bytes_per_second),
         channel.bytes_per_message > 0 ? fmt::format("{}", channel.bytes_per_message) : kNothing,
         Count(channel.tick), channel.type},
        Style::kPlain));
  }
  lines->push_back(
      Row(widths, {"all", fmt::format("{:.1f}", rate), "", "", Rate(bytes)}, Style::kPlain));
}

// SGR sequences stand in the order of Style.
constexpr const char* kColors[] = {"", "\x1b[7m", "\x1b[33m", "\x1b[1;31m"};

}  // namespace

std::vector<ViewLine> TopView(const RunSpec& spec, const logging::ElementNames& names,
                              const std::string& dir, const LiveSnapshot& snapshot,
                              int64_t refused) {
  std::vector<ViewLine> lines;
  AddHeader(spec, names, dir, snapshot, refused, &lines);
  lines.emplace_back();
  AddProcesses(spec, snapshot, &lines);
  lines.emplace_back();
  if (snapshot.bus && !snapshot.bus->online.empty()) {
    AddBus(*snapshot.bus, &lines);
    lines.emplace_back();
  }
  AddChannels(snapshot, &lines);
  return lines;
}

std::string PlainText(const std::vector<ViewLine>& lines, int width) {
  std::string text;
  for (auto begin = lines.begin(); begin != lines.end();) {
    if (begin->text.empty()) {
      text += '\n';
      ++begin;
      continue;
    }
    const auto end = std::find_if(  // of the table
        begin, lines.end(), [](const ViewLine& line) { return line.text.empty(); });
    const size_t columns = begin->ends.size();
    const auto fits = [&](size_t first, size_t last) {
      return std::all_of(begin, end, [&](const ViewLine& line) {
        const auto& ends = line.ends;
        return ends.size() <= last ||
               ends[0] + ends[last] - ends[first - 1] <= static_cast<size_t>(width);
      });
    };
    size_t first = 1;
    do {
      size_t last = first;
      while (last + 1 < columns && fits(first, last + 1)) ++last;
      if (first > 1) text += '\n';
      for (auto line = begin; line != end; ++line) {
        const auto& ends = line->ends;
        if (ends.empty() && first == 1) text += Wrapped(line->text, width, 4) + '\n';
        if (ends.size() <= first) continue;
        const size_t from = ends[first - 1], to = ends[std::min(last, ends.size() - 1)];
        text += line->text.substr(0, ends[0]) + line->text.substr(from, to - from) + '\n';
      }
      first = last + 1;
    } while (first < columns);
    begin = end;
  }
  return text;
}

void ViewScroll::Move(char key, int page) {
  constexpr int kAside = 8;  // characters
  if (key == 'k') --line;
  if (key == 'j') ++line;
  if (key == 'b') line -= page;
  if (key == 'f' || key == ' ') line += page;
  if (key == 'g') line = 0;
  if (key == 'G') line = std::numeric_limits<int>::max() / 2;
  if (key == 'h') column -= kAside;
  if (key == 'l') column += kAside;
}

std::string Frame(const std::vector<ViewLine>& lines, int columns, int rows, ViewScroll* scroll) {
  const auto width = static_cast<size_t>(std::max(columns, 1));
  const auto height = static_cast<size_t>(std::max(rows, 1));
  const size_t header = std::min({kTopHeader, lines.size(), height - 1});
  std::vector<const ViewLine*> rest;
  for (size_t i = header; i < lines.size(); ++i) {
    if (!lines[i].text.empty() || lines.size() < height) rest.push_back(&lines[i]);
  }
  const size_t room = std::min(rest.size(), height - 1 - header);
  size_t longest = 0;
  for (const ViewLine* line : rest) {
    if (!line->ends.empty()) longest = std::max(longest, line->text.size());
  }
  scroll->line = std::clamp(scroll->line, 0, static_cast<int>(rest.size() - room));
  scroll->column =
      std::clamp(scroll->column, 0, static_cast<int>(longest - std::min(longest, width)));
  const auto first = static_cast<size_t>(scroll->line), aside = static_cast<size_t>(scroll->column);

  std::string frame = "\x1b[H";
  const auto show = [&](const std::string& text, Style style) {
    frame += fmt::format("{}{}\x1b[0m\x1b[K", kColors[static_cast<size_t>(style)],
                         text.substr(0, width));
  };
  for (size_t i = 0; i < header; ++i) {
    show(lines[i].text, lines[i].style);
    frame += "\r\n";
  }
  for (size_t i = first; i < first + room; ++i) {
    const auto& [text, style, ends] = *rest[i];
    const bool moves = !ends.empty() && aside > 0;
    const size_t label = moves ? std::min(ends[0] + 1, text.size()) : 0;
    show(moves ? text.substr(0, label) + text.substr(std::min(text.size(), label + aside)) : text,
         style);
    frame += "\r\n";
  }
  std::string keys = "q quit";
  if (room < rest.size()) {
    keys += fmt::format("  arrows, space: lines {}-{} of {}", first + 1, first + room, rest.size());
  }
  if (longest > width) {
    keys += fmt::format("  left, right: columns {}-{} of {}", aside + 1, aside + width, longest);
  }
  show(keys, Style::kTitle);  // a line feed after it would scroll
  return frame + "\x1b[J";
}

}  // namespace poise
