// A graph's file and the files it is based on.
#pragma once

#include <string>
#include <vector>

#include "components/framework/graph.h"
#include "tools/scenario/based_files.h"

namespace poise {

/// Graph.base followed to its end. Immutable.
class GraphFiles {
 public:
  /// Reads `file`, its base (FindFile), and so on. Throws ConfigError "file:line: base: problem",
  /// "file:line: remove[0]: problem".
  explicit GraphFiles(const std::string& file);

  /// Channels and components of the furthest base first, less what is removed; name and description
  /// are the file's own. `base` and `remove` are gone.
  const Graph& Merged() const { return merged_; }
  /// "file:line: field: problem", in the file that has the field.
  std::string Line(const GraphError::Problem& problem) const;

 private:
  using File = BasedFile<Graph>;
  /// Where an element of the merged graph stands.
  struct Place {
    size_t file = 0;
    int index = 0;  // in the file's own list
  };
  void Merge();

  std::vector<File> files_;  // the furthest base first
  Graph merged_;
  std::vector<Place> channels_, components_;  // of the merged graph
};

}  // namespace poise
