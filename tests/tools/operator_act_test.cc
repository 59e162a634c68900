#include "tools/operator/operator_act.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "components/framework/configuration/configuration.h"
#include "poise/bridge_status_t.hpp"
#include "poise/emergency_stop_t.hpp"
#include "poise/message_traits.hpp"
#include "tests/test_seed.h"
#include "tools/live/control_desk.h"
#include "tools/live/view_access.h"
#include "tools/run/local_server.h"
#include "tools/scenario/run_setup.h"

namespace poise {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

const char* const kPush =
    R"({"client":7,"id":3,"do":"push","body":"","force":[1,-2.5,3e1],"point":[0,0,0.1],)"
    R"("duration":0.15})";

std::string ProblemOf(const std::string& text) {
  OperatorAct act;
  std::string problem;
  return ReadAct(text, &act, &problem) ? "" : problem;
}

RunSpec StandSpec() { return SetUpRun("stand", {}).spec; }

template <class Message>
std::vector<uint8_t> BytesOf(const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// A run whose components accept everything at tick 100, and whose bridge says nothing by itself.
class AcceptingPort : public ActPort {
 public:
  AcceptingPort() : ActPort(StandSpec()) {}
  void Update(int) override {}
  std::map<std::string, double> InForce() const override { return {}; }
  int64_t tick() const override { return 100; }
  void Tell(int8_t state, int64_t resets) {
    bridge_status_t status{};
    status.run_id = spec().run_id();
    status.tick = 200;
    status.state = state;
    status.resets = resets;
    HearStatus(BytesOf(status));
  }
  std::vector<operate::act_t> messages;
  std::vector<emergency_stop_t> stops;
  int8_t verdict = operate::answer_t::VERDICT_DONE;

 private:
  void Start(Waiting* waiting) override {
    if (MessageKind(waiting->act.kind) == 0) {
      SendStop(waiting->act.kind == OperatorAct::Kind::kStop, false);
    } else {
      ActPort::Send(waiting->message);
    }
  }
  bool Send(int channel, const std::vector<uint8_t>& bytes) override {
    const auto size = static_cast<int64_t>(bytes.size());
    if (channel == stop_channel_) return DecodeChecked(bytes.data(), size, &stops.emplace_back());
    operate::act_t act;
    EXPECT_EQ(channel, act_channel_);
    EXPECT_TRUE(DecodeChecked(bytes.data(), size, &act));  // which is false of what is not finite
    messages.push_back(act);
    operate::answer_t answer{};
    answer.run_id = act.run_id;
    answer.id = act.id;
    answer.component = act.component;
    answer.kind = act.kind;
    answer.verdict = verdict;
    answer.tick = 100;
    HearAnswer(BytesOf(answer));
    return true;
  }
};

OperatorAct ActOf(OperatorAct::Kind kind, int64_t id = 0) {
  OperatorAct act;
  act.kind = kind;
  act.id = id;
  return act;
}

TEST(OperatorActTest, ReadsWhatAPageSends) {
  OperatorAct act;
  std::string problem;
  ASSERT_TRUE(ReadAct(kPush, &act, &problem)) << problem;
  EXPECT_EQ(act.kind, OperatorAct::Kind::kPush);
  EXPECT_EQ(act.client, 7);
  EXPECT_EQ(act.id, 3);
  EXPECT_EQ(act.name, "");
  EXPECT_EQ(act.force, Eigen::Vector3d(1, -2.5, 30));
  EXPECT_EQ(act.point, Eigen::Vector3d(0, 0, 0.1));
  EXPECT_EQ(act.duration, 0.15);
  ASSERT_TRUE(ReadAct(R"({"id":0,"client":0,"do":"stop"})", &act, &problem)) << problem;
  EXPECT_EQ(act.kind, OperatorAct::Kind::kStop);
}

TEST(OperatorActTest, RefusesWhatNoPageSends) {
  const std::string head = R"({"client":1,"id":1,"do":)";
  EXPECT_EQ(ProblemOf(""), "no JSON object");
  EXPECT_EQ(ProblemOf("[]"), "no JSON object");
  EXPECT_EQ(ProblemOf(std::string(1000, '[')), "too many brackets");
  // The last one is for the terminal alone.
  for (const char* act : {"fly", "next_phase"}) {
    EXPECT_EQ(ProblemOf(head + '"' + act + "\"}"), "do: no such act");
  }
  EXPECT_THAT(ProblemOf(head + R"("stop","more":1})"), HasSubstr("other keys"));
  EXPECT_THAT(ProblemOf(head + R"("set","field":"a"})"), HasSubstr("value: missing"));
  for (const char* value : {"1e400", "1e10", "null", "\"1\"", "true", "NaN", "[1]"}) {
    EXPECT_NE(ProblemOf(head + R"("set","field":"a","value":)" + value + "}"), "") << value;
  }
  for (const char* force : {"[1,2]", "[1,2,3,4]", "[1,2,\"3\"]", "[1,2,[3]]", "5"}) {
    EXPECT_NE(ProblemOf(head + R"("push","body":"a","point":[0,0,0],"duration":1,"force":)" +
                        force + "}"),
              "")
        << force;
  }
  for (const char* id : {"-1", "1.5", "18446744073709551615", "\"1\"", "null"}) {
    EXPECT_NE(ProblemOf(std::string(R"({"client":1,"do":"stop","id":)") + id + "}"), "") << id;
  }
  EXPECT_NE(ProblemOf(head + R"("set","value":1,"field":")" + std::string(129, 'a') + "\"}"), "");
  EXPECT_NE(ProblemOf(head + R"("set","value":1,"field":"\u0000"})"), "");
}

// Texts near a good one, as an attacker who has the token may send: each is read or refused, and
// what is read is finite and short. POISE_HOSTILE_TEXTS: how many.
TEST(OperatorActTest, NoTextDoesHarm) {
  const char* const count = std::getenv("POISE_HOSTILE_TEXTS");
  const int64_t texts = count == nullptr ? 20'000 : std::atoll(count);
  std::mt19937_64 random(TestSeed(18));
  const auto below = [&](size_t n) { return static_cast<size_t>(random() % n); };
  const std::vector<std::string> pieces = {"{",
                                           "}",
                                           "[",
                                           "]",
                                           "\"",
                                           ",",
                                           ":",
                                           "1e308",
                                           "-0",
                                           "\\u0000",
                                           "null",
                                           "\"do\":\"back\"",
                                           "\"ticks\":9007199254740993",
                                           "\xff\xfe",
                                           "1e-400"};
  AcceptingPort port;
  ControlDesk desk(&port);
  for (int64_t i = 0; i < texts; ++i) {
    std::string text = kPush;
    for (size_t k = 1 + below(4); k > 0; --k) {
      const size_t at = below(text.size() + 1);
      switch (below(4)) {
        case 0:
          if (at < text.size()) text[at] = static_cast<char>(random());
          break;
        case 1:
          text.erase(at, below(12));
          break;
        case 2:
          text.insert(at, pieces[below(pieces.size())]);
          break;
        default:
          text.insert(at, text.substr(below(text.size() + 1), below(40)));
      }
      if (text.empty()) break;
    }
    if (desk.Receive(text)) {
      OperatorAct act;
      std::string problem;
      ASSERT_TRUE(ReadAct(text, &act, &problem));
      ASSERT_TRUE(act.force.allFinite() && act.point.allFinite() && act.velocity.allFinite());
      ASSERT_TRUE(std::isfinite(act.value) && act.duration >= 0 && act.ticks >= 0);
      ASSERT_LE(act.name.size(), 128U);
    }
    if (i % 64 == 0) {
      const auto told = desk.Take("1");
      ASSERT_LT(told.value_or("").size(), 20'000U);
    }
  }
  EXPECT_EQ(desk.received() + desk.refused(), texts);
  EXPECT_GT(desk.received(), 0);
  EXPECT_GT(desk.refused(), 0);
  EXPECT_GT(port.messages.size(), 0U);
}

TEST(ActPortTest, WritesAnActAsTheMessageOfWhoActsOnIt) {
  AcceptingPort port;
  OperatorAct push;
  std::string problem;
  ASSERT_TRUE(ReadAct(kPush, &push, &problem)) << problem;
  port.Do(push);
  OperatorAct set = ActOf(OperatorAct::Kind::kSet, 4);
  set.name = "task_controller.com.kp";
  set.value = port.fields().front().value;
  for (const LiveField& field : port.fields()) {
    if (field.path == set.name) set.value = field.most;
  }
  port.Do(set);
  port.Do(ActOf(OperatorAct::Kind::kStep, 5));
  OperatorAct move = ActOf(OperatorAct::Kind::kMove, 6);
  move.name = "left_knee_pitch";  // the controller says which joints it moves
  move.value = 0.5;
  move.duration = 0.1;
  port.Do(move);
  ASSERT_EQ(port.messages.size(), 4U);
  const Graph& graph = port.spec().graph();
  const operate::act_t& first = port.messages[0];
  EXPECT_EQ(graph.component(first.component).name(), "sim");
  EXPECT_EQ(first.kind, operate::act_t::KIND_PUSH);
  EXPECT_EQ(first.body, 0);
  EXPECT_EQ(first.force[1], -2.5);
  EXPECT_EQ(first.point[2], 0.1);
  EXPECT_EQ(first.duration, std::lround(0.15 / port.spec().tick_period()));
  const operate::act_t& second = port.messages[1];
  EXPECT_EQ(graph.component(second.component).name(), "task_controller");
  EXPECT_STREQ(reinterpret_cast<const char*>(second.field), "com.kp");
  EXPECT_EQ(second.value, set.value);
  EXPECT_EQ(graph.component(port.messages[2].component).name(), "step_planner");
  EXPECT_LT(port.messages[2].foot, 0);
  const operate::act_t& last = port.messages[3];
  EXPECT_EQ(graph.component(last.component).name(), "task_controller");
  EXPECT_EQ(last.kind, operate::act_t::KIND_JOINT);
  EXPECT_EQ(last.value, 0.5);
  EXPECT_EQ(last.duration, std::lround(0.1 / port.spec().tick_period()));
  const std::vector<OperatorAct> answers = port.TakeAnswers();
  ASSERT_EQ(answers.size(), 4U);
  EXPECT_EQ(answers[3].value, 0.5);  // what was asked for, though the answer's value is 0
  for (const OperatorAct& answer : answers) {
    EXPECT_EQ(answer.state, OperatorAct::State::kAccepted);
    EXPECT_EQ(answer.tick, 100);
  }
  EXPECT_TRUE(port.TakeAnswers().empty());
}

TEST(ActPortTest, RefusesWhatNobodyCouldTakeAndSaysWhatIsRefused) {
  AcceptingPort port;
  OperatorAct push = ActOf(OperatorAct::Kind::kPush);
  push.name = "tail";
  EXPECT_THROW(port.Do(push), ConfigError);
  push.name = "";
  push.force.x() = std::nan("");
  EXPECT_THROW(port.Do(push), ConfigError);
  OperatorAct walk = ActOf(OperatorAct::Kind::kWalk);
  walk.velocity.x() = 1.5;
  EXPECT_THROW(port.Do(walk), ConfigError);
  EXPECT_THROW(port.Do(ActOf(OperatorAct::Kind::kPause)), ConfigError);
  EXPECT_TRUE(port.messages.empty());
  EXPECT_TRUE(port.TakeAnswers().empty());
  port.verdict = operate::answer_t::VERDICT_NOT_NOW;
  port.Do(ActOf(OperatorAct::Kind::kStep));
  const std::vector<OperatorAct> answers = port.TakeAnswers();
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].state, OperatorAct::State::kRefused);
  EXPECT_THAT(answers[0].reason, HasSubstr("not now"));
}

// The bridge answers a stop and its reset, by what it does.
TEST(ActPortTest, AStopIsAcceptedWhenTheBridgeStopsAndResetWhenItHasReset) {
  AcceptingPort port;
  port.Do(ActOf(OperatorAct::Kind::kStop, 1));
  ASSERT_EQ(port.stops.size(), 1U);
  EXPECT_EQ(port.stops[0].stop, 1);
  EXPECT_EQ(port.stops[0].run_id, port.spec().run_id());
  EXPECT_THROW(port.Do(ActOf(OperatorAct::Kind::kReset, 2)), ConfigError);  // a stop is under way
  port.Tell(bridge_status_t::STATE_RUNNING, 3);
  EXPECT_FALSE(port.stopped());
  EXPECT_TRUE(port.TakeAnswers().empty());
  port.Tell(bridge_status_t::STATE_ESTOP, 3);
  EXPECT_TRUE(port.stopped());
  std::vector<OperatorAct> answers = port.TakeAnswers();
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].id, 1);
  EXPECT_EQ(answers[0].state, OperatorAct::State::kAccepted);
  EXPECT_EQ(answers[0].tick, 200);
  port.Do(ActOf(OperatorAct::Kind::kReset, 3));
  port.Tell(bridge_status_t::STATE_ESTOP, 3);
  EXPECT_TRUE(port.TakeAnswers().empty());
  port.Tell(bridge_status_t::STATE_RUNNING, 4);
  answers = port.TakeAnswers();
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].id, 3);
  EXPECT_EQ(answers[0].state, OperatorAct::State::kAccepted);
  EXPECT_FALSE(port.stopped());
}

TEST(ControlDeskTest, TellsWhatBecameOfAnAct) {
  AcceptingPort port;
  ControlDesk desk(&port);
  ASSERT_TRUE(desk.Receive(kPush));
  const auto told = desk.Take("12");
  ASSERT_TRUE(told);
  const auto json = nlohmann::json::parse(*told);
  EXPECT_EQ(json["run_id"], "12");
  ASSERT_EQ(json["control"]["acts"].size(), 1U);
  EXPECT_EQ(json["control"]["acts"][0]["state"], "accepted");
  EXPECT_EQ(json["control"]["acts"][0]["tick"], 100);
  EXPECT_FALSE(desk.Take("12"));  // nothing has changed
  EXPECT_EQ(json["control"]["can"], nlohmann::json({"push", "set", "step", "walk", "stop_walking",
                                                    "move", "stop", "reset"}));
  // What is beyond a page is refused before anybody receives it.
  const size_t sent = port.messages.size();
  ASSERT_TRUE(desk.Receive(
      R"({"client":7,"id":4,"do":"push","body":"","force":[0,1e6,0],"point":[0,0,0],"duration":1})"));
  const auto refused = nlohmann::json::parse(desk.Take("12").value_or("{}"));
  EXPECT_EQ(refused["control"]["acts"].back()["state"], "refused");
  EXPECT_EQ(port.messages.size(), sent);
}

TEST(ViewAccessTest, TakesThisMachineAlone) {
  EXPECT_TRUE(IsHere("127.0.0.1:80", 80));
  EXPECT_TRUE(IsHere("LOCALHOST:8080", 8080));
  for (const char* host : {"", "127.0.0.1", "127.0.0.1:8081", "localhost.evil:8080",
                           "127.0.0.1:80800", "[::1]:8080", "evil:8080", " 127.0.0.1:8080"}) {
    EXPECT_FALSE(IsHere(host, 8080)) << host;
  }
  EXPECT_TRUE(IsOriginHere("http://127.0.0.1:8080", 8080));
  for (const char* origin : {"null", "https://127.0.0.1:8080", "http://127.0.0.1:8080.evil",
                             "http://127.0.0.1:8081", "file://"}) {
    EXPECT_FALSE(IsOriginHere(origin, 8080)) << origin;
  }
}

TEST(ViewAccessTest, ReadsTargetsAndTokens) {
  const auto target = ReadTarget("/stream?token=ab&x&from=12&=3&before=7");
  ASSERT_TRUE(target);
  EXPECT_EQ(target->path, "/stream");
  EXPECT_EQ(target->token, "ab");
  EXPECT_EQ(target->from, 12);
  EXPECT_EQ(target->before, 7);
  for (const char* wrong : {"/?from=", "/?from=-1", "/?from=1x", "/?from=99999999999999999999",
                            "/?before=-1", "/?token=x&token=ab", "/?token=ab&token=ab"}) {
    EXPECT_FALSE(ReadTarget(wrong)) << wrong;
  }
  const std::string token = MakeToken();
  EXPECT_THAT(token, MatchesRegex("[0-9a-f]{32}"));
  EXPECT_NE(token, MakeToken());
  EXPECT_TRUE(SameToken(token, token));
  EXPECT_FALSE(SameToken("", token));
  EXPECT_FALSE(SameToken(token.substr(1), token));
  EXPECT_FALSE(SameToken(std::string(32, 'g'), token));
}

}  // namespace
}  // namespace poise
