#include "tools/cli/text_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>

namespace poise {
namespace {

// An address of a mesh made the defects' table of an import 126 columns wide.
TEST(TextTableTest, AWordThatIsTooLongForTheTerminalIsBroken) {
  const std::string address = "package://" + std::string(100, 'a') + "/foot.dae";
  const std::string table = FormatColumns(
      {{"defect", "what was done"}, {"mesh " + address + " cannot be read", "guess: a share"}}, 80);
  std::istringstream lines(table);
  std::string first_column;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(DisplayWidth(line), 80) << line;
    first_column += line.substr(0, line.find("  "));
  }
  EXPECT_NE(first_column.find(address), std::string::npos) << table;
  EXPECT_NE(table.find("guess: a share"), std::string::npos) << table;
}

}  // namespace
}  // namespace poise
