#include "tools/scenario/graph_files.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>

#include "components/framework/configuration/suggest.h"
#include "fmt/format.h"
#include "tools/cli/lists.h"

namespace poise {
namespace {

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

GraphFiles::GraphFiles(const std::string& file)
    : files_(ReadWithBases<Graph>(file, "graphs", BaseFiles::kRefused,
                                  [](const auto&... given) { ParseTextProto(given...); })) {
  Merge();
}

void GraphFiles::Merge() {
  for (size_t f = 0; f < files_.size(); ++f) {
    const Graph& graph = files_[f].fields;
    for (int i = 0; i < graph.remove_size(); ++i) {
      const std::string& name = graph.remove(i);
      if (Remove(name, merged_.mutable_component(), &components_) ||
          Remove(name, merged_.mutable_channel(), &channels_)) {
        continue;
      }
      std::vector<std::string> names = NamesOf(merged_.component());
      std::ranges::move(NamesOf(merged_.channel()), std::back_inserter(names));
      files_[f].Fail(fmt::format("remove[{}]", i),
                     names.empty() ? "there is no base to remove from; name one with base"
                                   : fmt::format("the base has no component or channel '{}'; {}",
                                                 name, Suggest(name, names)));
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
  const int line = place->Line(field);
  const std::string where = line > 0 ? fmt::format("{}:{}", place->name, line) : place->name;
  return problem.field.empty() ? fmt::format("{}: {}", where, problem.text)
                               : fmt::format("{}: {}: {}", where, field, problem.text);
}

}  // namespace poise
