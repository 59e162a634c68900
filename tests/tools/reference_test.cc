// What the program tells of its files and messages: `poise list fields`, `poise list messages`.
#include <gmock/gmock.h>
#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <regex>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "components/framework/graph.pb.h"
#include "components/robot_files/robot.pb.h"
#include "poise/message_traits.hpp"
#include "tools/reference/message_reference.h"
#include "tools/reference/reference_text.h"
#include "tools/reference/schemas.h"
#include "tools/scenario/scenario.pb.h"
#include "tools/sweep/sweep.pb.h"

namespace poise {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

struct SchemaCase {
  Schema schema;
  const Message* prototype;
};

std::vector<SchemaCase> Schemas() {
  return {{Schema::kScenario, &Scenario::default_instance()},
          {Schema::kRobot, &Robot::default_instance()},
          {Schema::kSweep, &Sweep::default_instance()},
          {Schema::kGraph, &Graph::default_instance()}};
}

std::string WithIndex(const std::string& path) {
  return std::regex_replace(path, std::regex("\\[i\\]"), "[0]");
}

/// The compiled class's field at a path of the reference.
const FieldDescriptor* CompiledField(const Message& prototype, const std::string& path) {
  const auto* type = prototype.GetDescriptor();
  const FieldDescriptor* field = nullptr;
  std::stringstream parts(path);
  for (std::string part; std::getline(parts, part, '.');) {
    if (type == nullptr) return nullptr;
    field = type->FindFieldByName(part.substr(0, part.find('[')));
    if (field == nullptr) return nullptr;
    type = field->message_type();
  }
  return field;
}

size_t CountFields(const google::protobuf::Descriptor& type) {
  size_t count = 0;
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& field = *type.field(i);
    if (field.full_name() == "poise.Scenario.applied") continue;
    count += 1 + (field.message_type() != nullptr ? CountFields(*field.message_type()) : 0);
  }
  return count;
}

TEST(FieldReference, HoldsEveryFieldThatTheProgramReads) {
  for (const SchemaCase& c : Schemas()) {
    EXPECT_EQ(FieldReference(c.schema).size(), CountFields(*c.prototype->GetDescriptor()))
        << c.prototype->GetTypeName();
  }
}

// A comment is the only place that tells; whoever adds a field writes it, unit first.
TEST(FieldReference, EveryFieldSaysWhatItMeansAndANumberItsUnit) {
  const std::regex without_unit("(share|ratio|factor|coefficient|component|number)[ :,].*",
                                std::regex::icase);
  for (const SchemaCase& c : Schemas()) {
    for (const FieldEntry& field : FieldReference(c.schema)) {
      const std::string name = c.prototype->GetTypeName() + ": " + field.path;
      const std::string told = field.meaning.substr(field.unit.size());
      EXPECT_THAT(told.substr(std::min<size_t>(2, told.size())), HasSubstr(" "))
          << name << ": its comment must say what it means";
      if (field.type.ends_with("number") || field.type == "list of numbers") {
        const bool whole = field.type.starts_with("whole");
        EXPECT_TRUE(whole || !field.unit.empty() || std::regex_match(field.meaning, without_unit))
            << name << ": its comment must begin with the unit, or with what kind of number it is: "
            << field.meaning;
      }
      for (const auto& [value, meaning] : field.values) {
        EXPECT_THAT(meaning, Not(IsEmpty())) << name << ": " << value << " needs a comment";
      }
    }
  }
}

TEST(FieldReference, DefaultsAreThoseOfTheCompiledClasses) {
  for (const SchemaCase& c : Schemas()) {
    for (const FieldEntry& field : FieldReference(c.schema)) {
      SCOPED_TRACE(c.prototype->GetTypeName() + ": " + field.path);
      const FieldDescriptor* compiled = CompiledField(*c.prototype, field.path);
      ASSERT_NE(compiled, nullptr);
      EXPECT_EQ(field.default_value.empty(), !compiled->has_default_value());
      if (field.default_value.empty() || compiled->is_repeated()) continue;
      // The printed default, read as any file is, gives the value that a message has without it.
      const std::unique_ptr<Message> owner(google::protobuf::MessageFactory::generated_factory()
                                               ->GetPrototype(compiled->containing_type())
                                               ->New());
      google::protobuf::TextFormat::Parser parser;
      parser.AllowPartialMessage(true);
      ASSERT_TRUE(
          parser.ParseFromString(compiled->name() + ": " + field.default_value, owner.get()));
      const auto* reflection = owner->GetReflection();
      ASSERT_TRUE(reflection->HasField(*owner, compiled));
      switch (compiled->cpp_type()) {
        case FieldDescriptor::CPPTYPE_DOUBLE:
          EXPECT_EQ(reflection->GetDouble(*owner, compiled), compiled->default_value_double());
          break;
        case FieldDescriptor::CPPTYPE_BOOL:
          EXPECT_EQ(reflection->GetBool(*owner, compiled), compiled->default_value_bool());
          break;
        case FieldDescriptor::CPPTYPE_ENUM:
          EXPECT_EQ(reflection->GetEnumValue(*owner, compiled),
                    compiled->default_value_enum()->number());
          break;
        case FieldDescriptor::CPPTYPE_STRING:
          EXPECT_EQ(reflection->GetString(*owner, compiled), compiled->default_value_string());
          break;
        case FieldDescriptor::CPPTYPE_INT32:
          EXPECT_EQ(reflection->GetInt32(*owner, compiled), compiled->default_value_int32());
          break;
        case FieldDescriptor::CPPTYPE_INT64:
          EXPECT_EQ(reflection->GetInt64(*owner, compiled), compiled->default_value_int64());
          break;
        case FieldDescriptor::CPPTYPE_UINT32:
          EXPECT_EQ(reflection->GetUInt32(*owner, compiled), compiled->default_value_uint32());
          break;
        case FieldDescriptor::CPPTYPE_UINT64:
          EXPECT_EQ(reflection->GetUInt64(*owner, compiled), compiled->default_value_uint64());
          break;
        default:
          ADD_FAILURE() << "a type that this test does not know";
      }
    }
  }
}

/// Checks that each default of a type, and of the groups in it, keeps its field's rule.
void ExpectDefaultsKeepTheirRules(const google::protobuf::Descriptor& type) {
  const std::unique_ptr<Message> message(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type)->New());
  const auto* reflection = message->GetReflection();
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor* field = type.field(i);
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      ExpectDefaultsKeepTheirRules(*field->message_type());
    } else if (field->has_default_value() && !field->is_repeated()) {
      if (field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
        reflection->SetDouble(message.get(), field, field->default_value_double());
      } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_INT32) {
        reflection->SetInt32(message.get(), field, field->default_value_int32());
      } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_UINT32) {
        reflection->SetUInt32(message.get(), field, field->default_value_uint32());
      }
    }
  }
  EXPECT_NO_THROW(CheckFields(*message)) << type.full_name();
}

TEST(FieldRules, EveryDefaultKeepsThem) {
  ExpectDefaultsKeepTheirRules(*Scenario::descriptor());  // all components' are in it
  ExpectDefaultsKeepTheirRules(*Robot::descriptor());
  ExpectDefaultsKeepTheirRules(*Sweep::descriptor());
  ExpectDefaultsKeepTheirRules(*RunSpec::descriptor());
}

TEST(FieldRules, AnErrorNamesPathValueAndRange) {
  const auto problem_of = [](const std::string& path, const std::string& value) -> std::string {
    Scenario scenario;
    if (path.starts_with("sim.push[1]")) SetField(&scenario, "sim.push[0].start", "1");
    SetField(&scenario, path, value);
    try {
      CheckFields(scenario);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(problem_of("sim.push[1].duration", "0"),
            "sim.push[1].duration: is 0; must be greater than 0");
  EXPECT_EQ(problem_of("sim.push[1].duration", "0.1"), "accepted");
  EXPECT_EQ(problem_of("sim.push[0].peak", "nan"), "sim.push[0].peak: is nan; must be finite");
  EXPECT_EQ(problem_of("redistributor.eta_min", "1.5"),
            "redistributor.eta_min: is 1.5; must be 0 to 1");
  EXPECT_EQ(problem_of("redistributor.landed_share", "0.5"),
            "redistributor.landed_share: is 0.5; must be at least 0 and less than 0.5");
  EXPECT_EQ(problem_of("hw_bridge.enable_cycles", "0"),
            "hw_bridge.enable_cycles: is 0; must be 1 or more");
  EXPECT_EQ(problem_of("step_planner.walk.clearance", "-1"),
            "step_planner.walk.clearance: is -1; must be greater than 0");
  EXPECT_EQ(problem_of("hw_bridge.ethercat.link.udp.port", "70000"),
            "hw_bridge.ethercat.link.udp.port: is 70000; must be 1 to 65535");
  EXPECT_EQ(problem_of("sim.crane.height", "inf"),
            "sim.crane.height: is inf; must be finite and 0 or more");
}

TEST(FieldRules, AFieldThatIsNotThereIsNamedWithItsRange) {
  Push push;
  push.set_duration(0.1);
  EXPECT_NO_THROW(RequireFields(push, {"duration"}));
  const auto problem_of = [&](const char* field) -> std::string {
    try {
      RequireFields(push, {"duration", field}, "push[2].");
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(problem_of("start"), "push[2].start: is missing; must be 0 or more");
  EXPECT_EQ(problem_of("peak"), "push[2].peak: is missing; must be a finite number");
}

TEST(FieldRules, TheReferenceTellsThem) {
  const auto fields = SelectFields(FieldReference(Schema::kScenario), "redistributor.eta_min");
  ASSERT_EQ(fields.size(), 1);
  EXPECT_EQ(fields[0].range, "0 to 1");
  EXPECT_THAT(FieldsAsText(fields, 80), HasSubstr("number, 0 to 1, default 0.02"));
  const auto entry = [](std::string path, std::string meaning, bool group = false) {
    FieldEntry entry;
    entry.path = std::move(path);
    entry.meaning = std::move(meaning);
    entry.group = group;
    return entry;
  };
  EXPECT_EQ(FieldIndex({entry("a", "text"), entry("b[i]", "First. Second.", true),
                        entry("b[i].c", ""), entry("b[i].d", "")},
                       80),
            "a                           text\nb                           2 fields. First.\n");
  EXPECT_EQ(FieldIndex({entry("a", "e.g. 7.2. Not more."), entry("b", "")}, 80),
            "a                           e.g. 7.2.\nb                           \n");
}

TEST(FieldReference, SetTakesEveryPathThatIsPrinted) {
  for (const FieldEntry& field : FieldReference(Schema::kScenario)) {
    if (field.group) continue;
    std::string value = field.default_value.empty() ? "1" : field.default_value;
    if (!field.values.empty()) value = field.values.front().first;
    if (value.starts_with('"')) value = value.substr(1, value.size() - 2);
    Scenario scenario;
    EXPECT_NO_THROW(SetField(&scenario, WithIndex(field.path), value)) << field.path;
  }
}

TEST(FieldReference, IsSelectedByPathByBeginningAndByPartOfAName) {
  const std::vector<FieldEntry> all = FieldReference(Schema::kScenario);
  const auto paths = [&](std::string_view beginning) {
    std::vector<std::string> result;
    for (const FieldEntry& field : SelectFields(all, beginning)) result.push_back(field.path);
    return result;
  };
  EXPECT_EQ(paths("").size(), all.size());
  EXPECT_THAT(paths("sim.push[0].peak"), ElementsAre("sim.push[i].peak"));
  EXPECT_EQ(paths("sim.push[0]"), paths("sim.push"));
  EXPECT_EQ(paths("sim.push."), paths("sim.push"));
  // A beginning ends where a name does: sim.push is not sim.push_sensor_noise.
  EXPECT_THAT(paths("sim.push"), Not(Contains("sim.push_sensor_noise")));
  EXPECT_THAT(paths("hw_bridge.hold_st"), ElementsAre("hw_bridge.hold_stiffness"));
  EXPECT_THAT(paths("stiffness"), Contains("sim.drive_train.gear_stiffness"));
  try {
    SelectFields(all, "stifness");
    FAIL() << "no such field";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("did you mean stiffness"));
  }
}

TEST(FieldReference, TheUnitIsWhatACommentBeginsWith) {
  EXPECT_EQ(UnitOf("N·m at the joint"), "N·m");
  EXPECT_EQ(UnitOf("m, l_x/2"), "m");
  EXPECT_EQ(UnitOf("s"), "s");
  EXPECT_EQ(UnitOf("A foot that stands"), "");
  EXPECT_EQ(UnitOf("A, of the motor"), "A");
  EXPECT_EQ(UnitOf("share of the load"), "");
}

// Without its first word, the unit, a sentence cannot be read.
TEST(FieldReference, TheSentenceOfACommentStaysWhole) {
  const std::string text =
      FieldsAsText(SelectFields(FieldReference(Schema::kScenario), "lead"), 1000);
  EXPECT_THAT(text, HasSubstr("lead: number, 0 to 60, default 0\n    s that the run begins before "
                              "the scenario's time 0"))
      << text;
}

// "no default" beside a comment that says "Default: a third of the sole" contradicts it.
TEST(FieldReference, AFieldThatTellsItsDefaultIsNotSaidToHaveNone) {
  FieldEntry field;
  field.path = "margin";
  field.type = "number";
  field.unit = "m";
  field.meaning = "m off each edge.";
  EXPECT_EQ(FieldsAsText({field}, 80), "margin: number, no default\n    m off each edge.\n");
  field.meaning = "m off each edge. Default: a third of the sole's width.";
  EXPECT_EQ(FieldsAsText({field}, 80),
            "margin: number\n    m off each edge. Default: a third of the sole's width.\n");
}

TEST(FieldReference, TextFitsItsWidth) {
  for (const SchemaCase& c : Schemas()) {
    std::istringstream text(FieldsAsText(FieldReference(c.schema), 80));
    for (std::string line; std::getline(text, line);) {
      if (!line.starts_with(' ')) continue;  // a path has one line
      EXPECT_LE(std::count_if(line.begin(), line.end(), [](char b) { return (b & 0xC0) != 0x80; }),
                80)
          << line;
    }
  }
}

TEST(MessageReference, HoldsEveryTypeOfTheBusWithItsPurposeAndFields) {
  const std::vector<MessageEntry> messages = MessageReference();
  for (const MessageType& type : MessageTypes()) {
    const MessageEntry& entry = FindMessage(messages, type.name);
    EXPECT_THAT(entry.summary, HasSubstr(" ")) << type.name;
    EXPECT_THAT(entry.definition, HasSubstr("int64_t tick")) << type.name;
    EXPECT_TRUE(entry.definition.ends_with("}\n")) << type.name;
  }
  EXPECT_EQ(&FindMessage(messages, "robot_state"), &FindMessage(messages, "robot_state_t"));
  EXPECT_THAT(FindMessage(messages, "robot_state_t").nested, ElementsAre("wrench_t"));
  EXPECT_THROW(FindMessage(messages, "robot_stat"), ConfigError);
}

}  // namespace
}  // namespace poise
