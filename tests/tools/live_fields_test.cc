// Every setting that can be changed while a run goes on: documented, bounded, and the field it
// says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <regex>
#include <set>

#include "components/framework/graph.h"
#include "components/framework/operator_acts.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "tools/operator/act_port.h"
#include "tools/scenario/catalog.h"
#include "tools/scenario/registry.h"
#include "tools/scenario/run_setup.h"
#include "tools/scenario/scenario_loading.h"

namespace poise {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using testing::HasSubstr;

/// The compiled configuration's field at a path without lists; nullptr: there is none.
const FieldDescriptor* FieldAt(const Descriptor* type, const std::string& path) {
  const FieldDescriptor* field = nullptr;
  std::stringstream parts(path);
  for (std::string part; std::getline(parts, part, '.');) {
    field = type == nullptr ? nullptr : type->FindFieldByName(part);
    if (field == nullptr) return nullptr;
    type = field->message_type();
  }
  return field;
}

struct Prepared {
  std::string name;
  RunSpec spec;
};

/// A run of each scenario and of each of its variants: what is live follows from the configuration.
std::vector<Prepared> Runs() {
  std::vector<Prepared> runs;
  for (const std::string& scenario : ListNames("scenarios")) {
    const LoadedScenario plain = LoadScenario(scenario, {});
    std::vector<std::string> variants = {""};
    for (const Variant& variant : plain.scenario.variant()) variants.push_back(variant.name());
    for (const std::string& variant : variants) {
      RunChanges changes;
      changes.variant = variant;
      runs.push_back({scenario + " " + variant, SetUpRun(scenario, changes).spec});
    }
  }
  return runs;
}

class LiveFieldsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { runs_ = new std::vector<Prepared>(Runs()); }
  static void TearDownTestSuite() { delete runs_; }
  static std::vector<Prepared>* runs_;
};
std::vector<Prepared>* LiveFieldsTest::runs_ = nullptr;

// What a slider or `poise set --list` shows stands in the field's comment and nowhere else.
TEST_F(LiveFieldsTest, EachIsADocumentedNumberWithUnitAndRange) {
  const std::regex without_unit("(share|ratio|factor|coefficient|number)[ :,].*",
                                std::regex::icase);
  std::set<int> components;
  std::set<std::string> seen;
  for (const Prepared& run : *runs_) {
    for (const LiveField& field : LiveFields(run.spec)) {
      const std::string name = run.name + ": " + field.path;
      const ComponentInstance& instance = run.spec.graph().component(field.component);
      const ComponentType* const type = Components().TypeNamed(TypeOf(instance));
      ASSERT_NE(type, nullptr) << name;
      ASSERT_TRUE(field.path.starts_with(instance.name() + ".")) << name;
      const FieldDescriptor* const compiled =
          FieldAt(type->config, field.path.substr(instance.name().size() + 1));
      ASSERT_NE(compiled, nullptr) << name << " is no field of " << type->config->full_name();
      EXPECT_EQ(compiled->cpp_type(), FieldDescriptor::CPPTYPE_DOUBLE) << name;
      EXPECT_FALSE(compiled->is_repeated()) << name;
      EXPECT_THAT(field.meaning, HasSubstr(" ")) << name << ": its comment says what it means";
      EXPECT_TRUE(!field.unit.empty() || std::regex_match(field.meaning, without_unit))
          << name << ": its comment begins with its unit: " << field.meaning;
      EXPECT_TRUE(std::isfinite(field.least) && std::isfinite(field.most)) << name;
      EXPECT_LT(field.least, field.most) << name;
      EXPECT_GE(field.value, field.least) << name;
      EXPECT_LE(field.value, field.most) << name;
      EXPECT_GT(field.ramp, 0) << name << ": a change would be a step of the torque";
      EXPECT_TRUE(seen.insert(name).second) << name << " stands twice";
      components.insert(field.component);
    }
  }
  EXPECT_GE(components.size(), 3u);  // else nothing was looked at
}

// A setting whose value is another field's would turn what it does not name.
TEST_F(LiveFieldsTest, EachIsTheFieldOfTheConfigurationThatItNames) {
  size_t changed = 0;
  for (Prepared& run : *runs_) {
    std::map<std::string, double> wanted;
    for (const LiveField& field : LiveFields(run.spec)) {
      // One of its own each, so that two that are exchanged differ, and close to what it was.
      const double step =
          0.001 * (field.most - field.least) + 1e-5 * static_cast<double>(++changed);
      const double value =
          field.value - step >= field.least ? field.value - step : field.value + step;
      wanted[field.path] = value;
    }
    RunSpec spec = run.spec;
    std::vector<std::string> changes;
    for (const auto& [path, value] : wanted) {
      changes.push_back(fmt::format("{}={:.17g}", path, value));
    }
    ChangeConfigurations(changes, &spec);
    const std::vector<LiveField> fields = LiveFields(spec);
    ASSERT_EQ(fields.size(), wanted.size()) << run.name;
    for (const LiveField& field : fields) {
      EXPECT_EQ(field.value, wanted[field.path]) << run.name << ": " << field.path;
    }
  }
  EXPECT_GT(changed, 100u);
}

}  // namespace
}  // namespace poise
