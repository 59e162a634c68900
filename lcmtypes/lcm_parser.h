// Reads the part of the LCM type language that Poise's messages use. Build-time only.
#pragma once

#include <string>
#include <vector>

namespace poise {

struct LcmField {
  int line = 0;
  std::string type;  ///< "double", "wrench_t"
  std::string name;
  std::string dimension;  ///< empty: scalar; a literal; or the name of a count
  std::string comment;    ///< behind // on the line that ends the declaration
  bool literal_dimension() const {
    return !dimension.empty() && dimension[0] >= '0' && dimension[0] <= '9';
  }
};

struct LcmStruct {
  std::string file;
  int line = 0;
  std::string package;
  std::string name;
  std::vector<LcmField> fields;
};

/// Parses one file with one struct. Throws std::runtime_error "file:line: problem".
LcmStruct ParseLcmFile(const std::string& path);

}  // namespace poise
