// A graph's file and the files it is based on.
#pragma once

#include <string>
#include <vector>

#include "components/framework/graph.h"

namespace poise {

/// Graph.base followed to its end. Immutable.
class GraphFiles {
 public:
  /// Reads `file`, its base (FindFile), and so on. Throws ConfigError "file:line: base: problem".
  explicit GraphFiles(const std::string& file);

  /// Channels and components of the furthest base first; name and description are the file's own.
  /// `base` is gone.
  Graph Merged() const;
  /// "file:line: field: problem", in the file that has the field.
  std::string Line(const GraphError::Problem& problem) const;

 private:
  struct File {
    std::string name;
    std::string text;
    Graph graph;
  };
  std::vector<File> files_;  // the furthest base first
};

}  // namespace poise
