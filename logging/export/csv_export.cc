#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/run.h"
#include "derived/message_traits.hpp"
#include "fmt/format.h"
#include "lcmtypes/field_table.h"
#include "lcmtypes/message_scalars.h"
#include "logging/derived/derived_reader.h"
#include "logging/export/log_export.h"
#include "logging/log_messages.h"
#include "logging/paged_file.h"
#include "logging/partial_file.h"
#include "logging/printable.h"

namespace poise::logging {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr char kUnitsFile[] = "columns.json";
constexpr size_t kMostChannels = 64;  // of a table whose graph is not known: damage makes up names

/// How many scalars stand before a message's own: counts and header.
size_t HeaderScalars(const MessageType& type) { return type.count_names.size() + 3; }

/// Values of a message's fields; counts and header are left out.
class Row final : public ScalarVisitor {
 public:
  explicit Row(const MessageType& type, std::string* to) : skip_(HeaderScalars(type)), to_(to) {}

  void Integer(std::string_view, int64_t value) override {
    if (Begin()) *to_ += fmt::format("{}", value);
  }
  void Real(std::string_view, double value) override {
    if (Begin() && !std::isnan(value)) *to_ += fmt::format("{}", value);
  }
  void Text(std::string_view, std::string_view value) override {
    if (Begin()) *to_ += CsvCell(value);
  }

 private:
  /// Writes the separator; true when the value is to follow.
  bool Begin() {
    if (seen_++ < skip_) return false;
    to_->push_back(',');
    return true;
  }

  size_t skip_;
  std::string* to_;
  size_t seen_ = 0;
};

/// What a channel's columns depend on.
struct Shape {
  const MessageType* type = nullptr;
  std::vector<uint8_t> counts;  // as encoded

  Shape(const MessageType* t, std::span<const uint8_t> data)
      : type(t), counts(data.begin() + 8, data.begin() + t->run_id_offset) {}
  bool operator==(const Shape&) const = default;
};

void AppendValues(const MessageType& type, std::span<const uint8_t> data, std::string* to) {
  Row row(type, to);
  type.visit(data.data(), static_cast<int64_t>(data.size()), &row);
}

/// Appends the columns' names, each after `prefix`, and adds their units to `units`; returns how
/// many they are.
size_t AppendNames(const MessageType& type, std::span<const uint8_t> data,
                   const ElementNames& elements, const std::string& prefix, std::string* to,
                   Json* units) {
  const std::vector<MessageScalar> scalars = ScalarsOf(type, data).value();
  const size_t skip = HeaderScalars(type);
  for (size_t i = skip; i < scalars.size(); ++i) {
    const std::string& path = scalars[i].path;
    const std::string name = prefix + elements.Label(type.name, path);
    to->append(",").append(name);
    (*units)[name] = UnitOf(type.name, path);
  }
  return scalars.size() - skip;
}

Json TimeUnits() { return {{"time", "s"}, {"tick", ""}}; }

void WriteUnits(const Json& units, CheckedFile* file) {
  file->Write(units.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

/// us from the run's start to the scenario's time 0; 0 when the run is not known.
int64_t LeadTime(const LogMessages& messages) {
  if (!messages.run_known()) return 0;
  const RunSpec& spec = messages.spec();
  return MakeTick(spec.lead_ticks(), spec.tick_period()).utime;
}

std::string TimeAndTick(int64_t utime, int64_t tick) {
  return fmt::format("{:.6f},{}", static_cast<double>(utime) * 1e-6, tick);
}

/// Damage may put anything into a channel's name, a path too.
bool IsFileName(std::string_view name) {
  return name.find_first_not_of(
             "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-") ==
         std::string_view::npos;
}

/// Where the messages of each tick stand in a log, in memory that does not grow with ticks that
/// come one after the other.
class TickPlaces {
 public:
  struct Place {
    uint64_t offset = 0;  // of the data, + 1; 0: none
    uint64_t size = 0;
  };

  /// `width`: places a tick.
  explicit TickPlaces(size_t width) : width_(width), places_(PagedFile::Scratch()) {}

  Place Get(uint64_t row, size_t column) {
    Place place;
    std::memcpy(&place, places_->At(At(row, column)), sizeof(place));
    return place;
  }
  void Set(uint64_t row, size_t column, const Place& place) {
    std::memcpy(places_->Writable(At(row, column)), &place, sizeof(place));
  }
  /// The row of a tick, which is made when there is none.
  uint64_t RowOf(int64_t tick) {
    auto after = runs_.upper_bound(tick);
    if (after != runs_.begin()) {
      Run& run = std::prev(after)->second;
      const uint64_t ahead =
          static_cast<uint64_t>(tick) - static_cast<uint64_t>(std::prev(after)->first);
      if (ahead < run.count) return run.row + ahead;
      if (ahead == run.count && run.row + run.count == rows_) {
        ++run.count;
        return NewRow();
      }
    }
    runs_[tick] = {rows_, 1};
    return NewRow();
  }
  /// Calls visit(tick, row) by ascending tick.
  template <class Visit>
  void ForEach(const Visit& visit) const {
    for (const auto& [first, run] : runs_) {
      for (uint64_t i = 0; i < run.count; ++i) visit(first + static_cast<int64_t>(i), run.row + i);
    }
  }

 private:
  struct Run {
    uint64_t row = 0;
    uint64_t count = 0;
  };
  uint64_t At(uint64_t row, size_t column) const { return (row * width_ + column) * sizeof(Place); }
  uint64_t NewRow() {
    places_->Resize(At(rows_ + 1, 0));
    return rows_++;
  }

  size_t width_;
  std::unique_ptr<PagedFile> places_;
  std::map<int64_t, Run> runs_;  // by first tick
  uint64_t rows_ = 0;
};

}  // namespace

std::vector<ExportedChannel> ExportCsv(const std::string& log, const std::string& folder) {
  LogMessages messages(log, LogMessages::Run::kIfKnown);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw LogError(fmt::format("{}: cannot be made: {}", folder, error.message()));
  struct Table {
    Table(const std::string& path, Shape s) : file(path), shape(std::move(s)) {}
    CheckedFile file;
    Shape shape;
  };
  const int64_t lead = LeadTime(messages);
  std::map<std::string, Table, std::less<>> tables;
  Json units = Json::object();
  CheckedFile units_file((fs::path(folder) / kUnitsFile).string());
  std::vector<ExportedChannel> results;
  DerivedReader events(&messages.reader(), messages);
  LogEvent event;
  std::string row;
  while (events.Next(&event)) {
    if (event.channel == kRunInfoChannel) continue;
    auto found = std::ranges::find(results, event.channel, &ExportedChannel::channel);
    if (found == results.end()) {
      found = results.insert(found, {std::string(event.channel), "", 0, 0});
    }
    ExportedChannel& result = *found;
    const MessageType* const type = messages.TypeOf(event);
    if (type == nullptr || !IsFileName(event.channel)) {
      ++result.refused;
      continue;
    }
    auto table = tables.find(event.channel);
    if (table == tables.end()) {
      const std::string name(event.channel);
      table = tables
                  .try_emplace(name, (fs::path(folder) / (name + ".csv")).string(),
                               Shape(type, event.data))
                  .first;
      result.type = type->name;
      row = "time,tick";
      Json& columns = units[name] = TimeUnits();
      AppendNames(*type, event.data, messages.names(), "", &row, &columns);
      table->second.file.Write(row + "\n");
    }
    if (table->second.shape != Shape(type, event.data)) {
      ++result.refused;
      continue;
    }
    row = TimeAndTick(ReadInt64(event.data.data() + type->run_id_offset + 16) - lead,
                      LogMessages::Tick(*type, event));
    AppendValues(*type, event.data, &row);
    row.push_back('\n');
    table->second.file.Write(row);
    ++result.messages;
  }
  // A table of another run among these would pass for one of this run.
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() != ".csv" || tables.contains(entry.path().stem().string()))
      continue;
    throw LogError(fmt::format(
        "{}: is no channel of this log and would stand among its tables; remove it or choose "
        "another folder",
        entry.path().string()));
  }
  if (error) throw LogError(fmt::format("{}: cannot be read: {}", folder, error.message()));
  for (auto& [name, table] : tables) table.file.Close();
  WriteUnits(units, &units_file);
  units_file.Close();
  return results;
}

std::vector<ExportedChannel> ExportMergedCsv(const std::string& log, const std::string& file) {
  LogMessages messages(log, LogMessages::Run::kIfKnown);
  struct Column {
    std::optional<Shape> shape;
    std::string names;
    size_t width = 0;
  };
  std::vector<ExportedChannel> results;
  Json units = TimeUnits();
  std::vector<Column> columns;
  std::map<std::string, size_t, std::less<>> index;
  const auto add = [&](const std::string& channel, const std::string& type) {
    index[channel] = results.size();
    results.push_back({channel, type, 0, 0});
    columns.emplace_back();
  };
  for (const Channel& channel : messages.spec().graph().channel()) {
    if (!channel.external()) add(channel.name(), channel.type());
  }
  DerivedReader events(&messages.reader(), messages);
  if (events.any()) add(kDerivedChannel, MessageTraits<derived::signals_t>::kName);
  const std::unique_ptr<PagedFile> derived = PagedFile::Scratch();  // their messages
  TickPlaces places(messages.run_known() ? std::max<size_t>(columns.size(), 1) : kMostChannels);
  LogEvent event;
  while (events.Next(&event)) {
    const MessageType* const type = messages.TypeOf(event);
    auto found = index.find(event.channel);
    if (found == index.end()) {
      // Without a graph a channel is exported when it is no service of the run.
      if (messages.run_known() || type == nullptr || type->has_strings ||
          !IsFileName(event.channel) || columns.size() == kMostChannels) {
        continue;
      }
      add(std::string(event.channel), type->name);
      found = index.find(event.channel);
    }
    ExportedChannel& result = results[found->second];
    Column& column = columns[found->second];
    if (type == nullptr || (column.shape && *column.shape != Shape(type, event.data))) {
      ++result.refused;
      continue;
    }
    if (!column.shape) {
      column.shape.emplace(type, event.data);
      column.width = AppendNames(*type, event.data, messages.names(),
                                 std::string(event.channel) + ".", &column.names, &units);
    }
    const uint64_t row = places.RowOf(LogMessages::Tick(*type, event));
    const bool first = places.Get(row, found->second).offset == 0;
    ++(first ? result.messages : result.refused);
    if (!first) continue;
    const uint64_t at = events.IsDerived(event.channel)
                            ? derived->Append(event.data)
                            : static_cast<uint64_t>(event.data.data() - messages.reader().bytes());
    places.Set(row, found->second, {at + 1, event.data.size()});
  }
  const int64_t lead = LeadTime(messages);
  CheckedFile out(file);
  std::string row = "time,tick";
  for (const Column& column : columns) row += column.names;
  out.Write(row + "\n");
  PagedFile bytes(log);
  places.ForEach([&](int64_t tick, uint64_t at) {
    row.clear();
    std::string cells;
    for (size_t i = 0; i < columns.size(); ++i) {
      const TickPlaces::Place place = places.Get(at, i);
      if (place.offset == 0) {
        cells.append(columns[i].width, ',');
        continue;
      }
      PagedFile& from = events.IsDerived(results[i].channel) ? *derived : bytes;
      const uint8_t* const begin = from.At(place.offset - 1);
      const MessageType& type = *columns[i].shape->type;
      if (row.empty()) row = TimeAndTick(ReadInt64(begin + type.run_id_offset + 16) - lead, tick);
      AppendValues(type, {begin, place.size}, &cells);
    }
    out.Write(row + cells + "\n");
  });
  CheckedFile units_file(fs::path(file).replace_extension(kUnitsFile).string());
  WriteUnits(units, &units_file);
  out.Close();
  units_file.Close();
  return results;
}

}  // namespace poise::logging
