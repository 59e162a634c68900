#include "tools/scenario/graph_files.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/suggest.h"
#include "fmt/format.h"
#include "tools/scenario/catalog.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

/// Removes the element of that name from a list and its places. False: there is none.
template <class List, class Places>
bool Remove(const std::string& name, List* list, Places* places) {
  const auto found = std::ranges::find(*list, name, [](const auto& each) { return each.name(); });
  if (found == list->end()) return false;
  places->erase(places->begin() + (found - list->begin()));
  list->erase(found);
  return true;
}

}  // namespace

GraphFiles::GraphFiles(const std::string& file) {
  std::string name = file;
  while (true) {
    File read{name, ReadFile(name), {}};
    ParseTextProto(read.text, name, &read.graph);
    files_.insert(files_.begin(), read);
    if (!read.graph.has_base()) break;
    const auto fail = [&](const std::string& problem) { Fail(read, "base", problem); };
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
  Merge();
}

void GraphFiles::Fail(const File& file, const std::string& field, const std::string& problem) {
  throw ConfigError(fmt::format("{}:{}: {}: {}", file.name,
                                LocateField(file.text, field, file.graph), field, problem));
}

void GraphFiles::Merge() {
  for (size_t f = 0; f < files_.size(); ++f) {
    const Graph& graph = files_[f].graph;
    for (int i = 0; i < graph.remove_size(); ++i) {
      const std::string& name = graph.remove(i);
      if (Remove(name, merged_.mutable_component(), &components_) ||
          Remove(name, merged_.mutable_channel(), &channels_)) {
        continue;
      }
      std::vector<std::string> names;
      for (const ComponentInstance& each : merged_.component()) names.push_back(each.name());
      for (const Channel& each : merged_.channel()) names.push_back(each.name());
      Fail(files_[f], fmt::format("remove[{}]", i),
           names.empty() ? "there is no base to remove from; name one with base"
                         : fmt::format("the base has no component or channel '{}'; {}", name,
                                       Suggest(name, names)));
    }
    merged_.MergeFrom(graph);
    for (int i = 0; i < graph.channel_size(); ++i) channels_.push_back({f, i});
    for (int i = 0; i < graph.component_size(); ++i) components_.push_back({f, i});
  }
  merged_.clear_base();
  merged_.clear_remove();
}

std::string GraphFiles::Line(const GraphError::Problem& problem) const {
  const File* place = &files_.back();
  std::string field = problem.field;
  const size_t bracket = field.find('[');
  const std::vector<Place>& places = field.starts_with("channel") ? channels_ : components_;
  const size_t index = bracket == std::string::npos
                           ? places.size()
                           : static_cast<size_t>(std::atoi(field.c_str() + bracket + 1));
  if (index < places.size()) {  // else a run has added it, or the problem is of the whole graph
    place = &files_[places[index].file];
    field = fmt::format("{}[{}{}", field.substr(0, bracket), places[index].index,
                        field.substr(field.find(']')));
  }
  const int line = LocateField(place->text, field, Graph());
  const std::string where = line > 0 ? fmt::format("{}:{}", place->name, line) : place->name;
  return problem.field.empty() ? fmt::format("{}: {}", where, problem.text)
                               : fmt::format("{}: {}: {}", where, field, problem.text);
}

}  // namespace poise
