#include "tools/charts/sweep_labels.h"

#include <algorithm>
#include <vector>

#include "components/framework/configuration/text_pattern.h"
#include "fmt/format.h"
#include "logging/metrics/metrics.h"
#include "tools/cli/lists.h"
#include "tools/reference/schemas.h"
#include "tools/sweep/sweep_points.h"

namespace poise {
namespace {

/// "peak of push[0]" of "sim.push[0].peak".
std::string WordsOfField(const std::string& field) {
  const size_t last = field.rfind('.');
  if (last == std::string::npos) return Spaced(field);
  const size_t before = field.rfind('.', last - 1);
  const size_t begin = before == std::string::npos ? 0 : before + 1;
  return fmt::format("{} of {}", Spaced(field.substr(last + 1)),
                     Spaced(field.substr(begin, last - begin)));
}

/// Returns the unit of a scenario's field, "sim.push[0].peak"; empty when its schema says none.
std::string UnitOfField(const std::string& field) {
  static const std::vector<FieldEntry> fields = FieldReference(Schema::kScenario);
  const std::string path = WithReplaced(field, "\\[[0-9]+\\]", "[i]");
  const auto known = std::ranges::find(fields, path, &FieldEntry::path);
  return known == fields.end() ? "" : known->unit;
}

template <class Quantity>
std::string PlainNameOf(const Quantity& quantity) {
  return quantity.has_name() ? Spaced(quantity.name()) : WordsOfField(quantity.field());
}

}  // namespace

std::string PlainName(const Variable& variable) { return PlainNameOf(variable); }
std::string PlainName(const Limit& limit) { return PlainNameOf(limit); }

bool IsSeed(const Variable& variable) { return variable.field() == "seed"; }

std::string UnitOf(const Variable& variable) {
  if (variable.has_unit()) return variable.unit();
  return variable.angle() ? "°" : UnitOfField(variable.field());
}

std::string UnitOf(const Limit& limit) {
  return limit.has_unit() ? limit.unit() : UnitOfField(limit.field());
}

std::string MetricLabel(const std::string& metric) {
  const logging::Metric* const known = logging::FindMetric(metric);
  return known == nullptr ? metric : known->description;
}

std::string MetricUnit(const std::string& metric) {
  const logging::Metric* const known = logging::FindMetric(metric);
  return known == nullptr ? "" : known->unit;
}

}  // namespace poise
