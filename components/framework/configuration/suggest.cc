#include "components/framework/configuration/suggest.h"

#include <algorithm>
#include <numeric>

#include "fmt/format.h"

namespace poise {
namespace {

size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 0; i < a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i + 1;
    for (size_t j = 0; j < b.size(); ++j) {
      const size_t above = row[j + 1];
      row[j + 1] = std::min({above + 1, row[j] + 1, diagonal + (a[i] == b[j] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row.back();
}

}  // namespace

std::vector<std::string> Nearest(std::string_view name, std::vector<std::string> names) {
  std::sort(names.begin(), names.end());
  std::vector<std::string> near;
  for (const std::string& candidate : names) {
    if (EditDistance(name, candidate) <= std::max<size_t>(2, name.size() / 3))
      near.push_back(candidate);
  }
  std::stable_sort(near.begin(), near.end(), [&](const std::string& a, const std::string& b) {
    return EditDistance(name, a) < EditDistance(name, b);
  });
  if (near.size() > 3) near.resize(3);
  return near;
}

std::string Suggest(std::string_view name, std::vector<std::string> names) {
  const std::vector<std::string> near = Nearest(name, names);
  if (!near.empty()) return fmt::format("did you mean {}?", fmt::join(near, " or "));
  std::sort(names.begin(), names.end());
  return fmt::format("use one of {}", fmt::join(names, ", "));
}

}  // namespace poise
