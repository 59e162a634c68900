// The page of a sweep's maps: opens without a network.
#pragma once

#include <string>
#include <vector>

namespace poise {

struct MapsPageContent {
  std::string title;
  std::string description;
  std::vector<std::string> edge;       ///< sentences: where survival ends
  std::vector<std::string> survival;   ///< charts of it
  std::vector<std::string> tables;     ///< in plain text
  std::vector<std::string> metrics;    ///< charts of what the runs measured, folded away
  std::vector<std::string> constants;  ///< sentences: metrics that are the same in every run
};

std::string FormatMapsPage(const MapsPageContent& content);

}  // namespace poise
