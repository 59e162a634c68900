#include "tools/scenario/graph_files.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/scenario/catalog.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

/// "channel[3].type" less `count` elements that other files have: "channel[1].type". Empty: it is
/// one of them.
std::string WithoutFirst(const std::string& field, const char* list, int count) {
  const std::string begin = fmt::format("{}[", list);
  if (!field.starts_with(begin)) return field;
  const int index = std::atoi(field.c_str() + begin.size());
  if (index < count) return {};
  return fmt::format("{}{}{}", begin, index - count, field.substr(field.find(']')));
}

}  // namespace

GraphFiles::GraphFiles(const std::string& file) {
  std::string name = file;
  while (true) {
    File read{name, ReadFile(name), {}};
    ParseTextProto(read.text, name, &read.graph);
    files_.insert(files_.begin(), read);
    if (!read.graph.has_base()) return;
    const auto fail = [&](const std::string& problem) {
      throw ConfigError(
          fmt::format("{}:{}: base: {}", name, LocateField(read.text, "base", Graph()), problem));
    };
    fs::path base;
    try {
      base = FindFile("graphs", read.graph.base(), fs::path(name).parent_path());
    } catch (const ConfigError& error) {
      fail(error.what());
    }
    const auto same = [&](const File& other) { return fs::equivalent(other.name, base); };
    if (std::any_of(files_.begin(), files_.end(), same)) fail("the bases form a loop");
    name = base.string();
  }
}

Graph GraphFiles::Merged() const {
  Graph merged;
  for (const File& file : files_) merged.MergeFrom(file.graph);
  merged.clear_base();
  return merged;
}

std::string GraphFiles::Line(const GraphError::Problem& problem) const {
  const File* place = &files_.back();
  std::string field = problem.field;
  for (auto file = files_.begin(); file != files_.end(); ++file) {
    const int channels = file->graph.channel_size();
    const int components = file->graph.component_size();
    const std::string later =
        WithoutFirst(WithoutFirst(field, "channel", channels), "component", components);
    place = &*file;
    if (later.empty() || file + 1 == files_.end()) break;
    field = later;
  }
  const int line = LocateField(place->text, field, Graph());
  const std::string where = line > 0 ? fmt::format("{}:{}", place->name, line) : place->name;
  return problem.field.empty() ? fmt::format("{}: {}", where, problem.text)
                               : fmt::format("{}: {}: {}", where, field, problem.text);
}

}  // namespace poise
