#include "tools/live/operator_act.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "tests/test_seed.h"
#include "tools/live/control_desk.h"
#include "tools/live/view_access.h"
#include "tools/run/local_server.h"

namespace poise {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

const char* const kPush =
    R"({"client":7,"id":3,"do":"push","body":"trunk","force":[1,-2.5,3e1],"point":[0,0,0.1],)"
    R"("duration":0.15})";

std::string ProblemOf(const std::string& text) {
  OperatorAct act;
  std::string problem;
  return ReadAct(text, &act, &problem) ? "" : problem;
}

/// Accepts everything at tick 100.
class AcceptingSink : public OperatorSink {
 public:
  void Do(const OperatorAct& act) override {
    acts.push_back(act);
    answers_.push_back({act.client, act.id, true, 100, ""});
  }
  std::vector<Answer> TakeAnswers() override { return std::exchange(answers_, {}); }
  nlohmann::ordered_json Standing() const override { return {{"can", {"push"}}}; }
  std::vector<OperatorAct> acts;

 private:
  std::vector<Answer> answers_;
};

TEST(OperatorActTest, ReadsWhatAPageSends) {
  OperatorAct act;
  std::string problem;
  ASSERT_TRUE(ReadAct(kPush, &act, &problem)) << problem;
  EXPECT_EQ(act.kind, OperatorAct::Kind::kPush);
  EXPECT_EQ(act.client, 7);
  EXPECT_EQ(act.id, 3);
  EXPECT_EQ(act.name, "trunk");
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
  EXPECT_EQ(ProblemOf(head + R"("fly"})"), "do: no such act");
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
  AcceptingSink sink;
  ControlDesk desk(&sink);
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
      const OperatorAct& act = sink.acts.back();
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
}

TEST(ControlDeskTest, TellsWhatBecameOfAnAct) {
  AcceptingSink sink;
  ControlDesk desk(&sink);
  ASSERT_TRUE(desk.Receive(kPush));
  const auto told = desk.Take("12");
  ASSERT_TRUE(told);
  const auto json = nlohmann::json::parse(*told);
  EXPECT_EQ(json["run_id"], "12");
  ASSERT_EQ(json["control"]["acts"].size(), 1U);
  EXPECT_EQ(json["control"]["acts"][0]["state"], "accepted");
  EXPECT_EQ(json["control"]["acts"][0]["tick"], 100);
  EXPECT_FALSE(desk.Take("12"));  // nothing has changed
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
