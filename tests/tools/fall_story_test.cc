// What is told of a fall: lists of events made by hand.
#include "tools/report/fall_story.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "logging/events/event_spans.h"
#include "tools/report/event_list.h"

namespace poise {
namespace {

using logging::Event;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

auto Named(const std::string& name, double begin) {
  return testing::AllOf(Field("name", &Trouble::name, name),
                        Field("begin", &Trouble::begin, begin));
}

/// A walk that lost a contact for 14 ms early, searched once and landed, and fell at 44 s.
std::vector<Event> Fall() {
  return {{0, "phase_began", "phase 0, walk"},
          {4.368, "contact_lost", "right foot, which was to carry 29 N"},
          {4.382, "contact_regained", "right foot, which was to carry 29 N, after 0.014 s"},
          {9.838, "searching", "right foot without contact 4.0 mm above the other sole"},
          {10.502, "step_lands", "right foot at (0.60, -0.15) m"},
          {43.24, "step_needed", "a foot at (1.54, 0.45) m within 0.70 s"},
          {43.38, "eta_infeasible_begins", "no ratio meets all conditions; eta 0.002"},
          {43.664, "eta_infeasible_ends", "no ratio meets all conditions; eta 0.002"},
          {43.9, "bridge_state", "running to stopping: joint too fast (left_knee_pitch)"},
          {44, "fall", "true COM 0.410 m high"},
          {44.002, "run_ended", "55.998 s before its planned end"}};
}

TEST(FallStory, BeginsWithWhatDidNotEndAgain) {
  EXPECT_THAT(TroublesBefore(44, Fall()),
              ElementsAre(Named("step_needed", 43.24), Named("eta_infeasible_begins", 43.38),
                          Named("bridge_state", 43.9)));
}

TEST(FallStory, WhatWasOverLongBeforeIsNotTold) {
  std::vector<Event> events = Fall();
  events.erase(events.begin() + 5, events.begin() + 9);
  EXPECT_THAT(TroublesBefore(44, events), IsEmpty());
  // A foot that still searches is what led to it, however long ago it began to.
  events.erase(events.begin() + 4);
  EXPECT_THAT(TroublesBefore(44, events), ElementsAre(Named("searching", 9.838)));
}

TEST(FallStory, WhatBeganLongBeforeAndEndedInTheLastStretchIsTold) {
  const std::vector<Event> events = {{38, "searching", "right foot without contact"},
                                     {43.5, "step_lands", "right foot at (0.60, -0.15) m"},
                                     {43.9, "bridge_state", "running to stopping"},
                                     {44, "fall", ""}};
  EXPECT_THAT(TroublesBefore(44, events),
              ElementsAre(Named("searching", 38), Named("bridge_state", 43.9)));
}

TEST(FallStory, ATroubleThatFlickersToTheEndDidNotEnd) {
  std::vector<Event> events;
  for (double time = 20; time < 24; time += 0.125) {
    events.push_back({time, "eta_infeasible_begins", "no ratio"});
    events.push_back({time + 0.0625, "eta_infeasible_ends", "no ratio, after 0.063 s"});
  }
  events.push_back({24, "fall", ""});
  const std::vector<Trouble> troubles = TroublesBefore(24, events);
  ASSERT_THAT(troubles, ElementsAre(Named("eta_infeasible_begins", 20)));
  EXPECT_FALSE(troubles.front().end);
}

TEST(FallStory, EachFootHasItsOwnContact) {
  const std::vector<Event> events = {{1, "contact_lost", "right foot, which was to carry 29 N"},
                                     {1.5, "contact_lost", "left foot, which was to carry 90 N"},
                                     {1.6, "contact_regained", "left foot, after 0.1 s"},
                                     {3, "fall", ""}};
  const std::vector<Trouble> troubles = TroublesBefore(3, events);
  ASSERT_FALSE(troubles.empty());
  EXPECT_THAT(troubles.front(), Named("contact_lost", 1));
  EXPECT_FALSE(troubles.front().end);
}

// The motor was hot before anything else went wrong; what it could not give in the fall itself is
// not why it fell.
TEST(FallStory, BeginsWithTheMotorThatSetInFirst) {
  const std::vector<Event> events = {
      {1.84, "motor_limited", "left_ankle_roll: 18.0 to 19.0 N·m, of 24.0 N·m wanted"},
      {1.9, "motor_limited_ends", "left_ankle_roll, after 0.060 s"},
      {3.112, "motor_hot", "right_ankle_pitch: 12.7 to 7.5 N·m, of 14.1 N·m wanted"},
      {3.2, "motor_limited", "left_ankle_roll: 18.0 to 19.0 N·m, of 25.0 N·m wanted"},
      {3.3, "motor_limited_ends", "left_ankle_roll, after 0.100 s"},
      {3.888, "step_needed", "a foot at (0.10, 0.45) m within 0.70 s"},
      {4.2, "motor_limited", "right_hip_yaw: 18.0 to 88.0 N·m, of 325.0 N·m wanted"},
      {4.3, "fall", ""}};
  EXPECT_THAT(TroublesBefore(4.3, events),
              ElementsAre(Named("motor_hot", 3.112), Named("motor_limited", 3.2),
                          Named("step_needed", 3.888)));
}

/// Fall() with `steps` of a walk in it.
std::vector<Event> LongFall(int steps) {
  std::vector<Event> events;
  for (int i = 0; i < steps; ++i) {
    const double time = 11 + 0.5 * i;
    events.push_back({time, "step_begins", "left foot"});
    events.push_back({time + 0.25, "step_lands", "left foot"});
  }
  std::vector<Event> fall = Fall();
  events.insert(events.begin(), fall.begin(), fall.begin() + 5);
  events.insert(events.end(), fall.begin() + 5, fall.end());
  return events;
}

TEST(EventList, TellsTheLastSecondsBeforeAFallInFull) {
  const std::vector<Event> events = LongFall(60);
  const std::string text = FormatEvents(events);
  for (const Event& event : events) {
    char time[20];
    std::snprintf(time, sizeof time, "%7.3f s  ", event.time);
    if (event.time > 41) {
      EXPECT_THAT(text, HasSubstr(time));
    }
  }
  EXPECT_THAT(text, HasSubstr(" more lines to "));
  EXPECT_THAT(text, HasSubstr(" step begins"));
  // That file is not always there.
  EXPECT_THAT(text, Not(HasSubstr("summary.json")));
}

TEST(EventList, FoldsShortTurnsIntoALineWithTheirCount) {
  std::vector<Event> events;
  for (int i = 0; i < 100; ++i) {
    const double time = 0.5 + 0.004 * i;
    events.push_back({time, "balancing_on", "y: CoP of the task torque 68.3 mm"});
    events.push_back({time + 0.002, "balancing_off", "y, after 0.002 s"});
  }
  events.push_back({0.746, "step_lands", "left foot"});
  events.push_back({2, "balancing_on", "x: CoP of the task torque 150 mm"});
  events.push_back({3, "balancing_off", "x, after 1.000 s"});
  std::ranges::stable_sort(events, {}, &Event::time);
  const std::string text = FormatEvents(events);
  EXPECT_EQ(std::ranges::count(text, '\n'), 6) << text;  // one is wrapped
  EXPECT_THAT(text, HasSubstr("; 100 times until"));
  EXPECT_THAT(text, HasSubstr("step lands"));
  EXPECT_THAT(text, HasSubstr("after 1.000 s"));  // what lasts keeps its two lines
}

TEST(EventSpans, PairsAxesApartAndBridgesGaps) {
  const std::vector<Event> events = {{1, "balancing_on", "x: CoP"},
                                     {1.1, "balancing_on", "y: CoP"},
                                     {1.2, "balancing_off", "x, after 0.2 s"},
                                     {1.25, "balancing_on", "x: CoP"},
                                     {2, "balancing_off", "x, after 0.75 s"}};
  const std::vector<logging::EventSpan> spans = logging::EventSpans(events, 0.1);
  ASSERT_EQ(spans.size(), 2u);
  EXPECT_EQ(spans[0].times, 2);
  EXPECT_EQ(spans[0].end, 2);
  EXPECT_EQ(spans[1].part, "y");
  EXPECT_FALSE(spans[1].end);
  EXPECT_EQ(logging::EventSpans(events, 0.01).size(), 3u);
}

}  // namespace
}  // namespace poise
