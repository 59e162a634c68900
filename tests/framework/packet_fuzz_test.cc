// Random and mutated packets through every check and decoder. POISE_FUZZ_PACKETS sets how many.
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <map>
#include <random>

#include "components/framework/bus/collected_channel.h"
#include "components/framework/bus/inbox.h"
#include "components/framework/bus/service_filter.h"
#include "components/framework/bus/udp_bus.h"
#include "components/framework/component.h"
#include "components/framework/run.h"
#include "tests/every_message.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

constexpr int64_t kRun = 0x1234;

int64_t NumPackets() {
  const char* text = std::getenv("POISE_FUZZ_PACKETS");
  return text != nullptr ? std::atoll(text) : 200'000;
}

template <class T>
MessageCounts SomeCounts() {
  const std::map<std::string, int32_t> values = {
      {"num_joints", 12}, {"num_feet", 2}, {"num_motors", 12}, {"num_slaves", 12}};
  MessageCounts counts;
  for (const char* name : MessageTraits<T>::kCountNames) counts.push_back(values.at(name));
  return counts;
}

using Random = std::mt19937_64;
using Bytes = std::vector<uint8_t>;

/// Damages a right packet, or makes one up.
Bytes Hostile(const Bytes& right, Random& random) {
  Bytes bytes = right;
  const auto below = [&](size_t n) {
    return static_cast<size_t>(random() % std::max<size_t>(n, 1));
  };
  const auto put = [&](size_t at, uint64_t value, size_t width) {
    for (size_t i = 0; i < width && at + i < bytes.size(); ++i)
      bytes[at + i] = static_cast<uint8_t>(value >> (8 * (width - 1 - i)));
  };
  constexpr uint64_t kNasty[] = {0,
                                 1,
                                 0x7fffffff,
                                 0x80000000,
                                 0xffffffff,
                                 0x10000000,
                                 0x20000000,
                                 0x7ff8000000000000,
                                 0x7ff0000000000000,
                                 0xfff0000000000000,
                                 0x8000000000000000,
                                 0x7fffffffffffffff};
  switch (random() % 7) {
    case 0:  // noise of any size
      bytes.resize(below(2 * right.size() + 2));
      for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random());
      break;
    case 1:  // noise behind a right fingerprint
      for (size_t i = 8; i < bytes.size(); ++i) bytes[i] = static_cast<uint8_t>(random());
      break;
    case 2:  // cut or extended
      bytes.resize(below(2 * right.size() + 2));
      break;
    case 3:  // some bits
      for (size_t n = 1 + below(8); n-- > 0;)
        bytes[below(bytes.size())] ^= static_cast<uint8_t>(1u << below(8));
      break;
    case 4:  // a nasty 32-bit value in the counts, or anywhere
      put(random() % 2 ? 8 + 4 * below(3) : below(bytes.size()), kNasty[below(std::size(kNasty))],
          4);
      break;
    case 5:  // a nasty 64-bit value where a number may stand
      put(8 * below(bytes.size() / 8) + (random() % 2 ? 0 : 4), kNasty[below(std::size(kNasty))],
          8);
      break;
    default:  // untouched but for the ticks
      put(8 + 4 * below(3), random(), 8);
      break;
  }
  bytes.shrink_to_fit();
  return bytes;
}

template <class T>
Bytes Encode(const T& message) {
  Bytes bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

TEST(PacketFuzz, OnlyWhatReencodesToItselfIsAccepted) {
  Random random(TestSeed(20240607));
  const int64_t packets_a_type = NumPackets() / static_cast<int64_t>(MessageTypes().size()) + 1;
  int64_t total = 0;
  int64_t total_refused = 0;
  int64_t total_collected = 0;
  ForEveryType([&]<class T>() {
    SCOPED_TRACE(MessageTraits<T>::kName);
    T message{};
    MessageTraits<T>::Resize(message, SomeCounts<T>());
    message.run_id = kRun;
    message.tick = 100;
    const Bytes right = Encode(message);
    for (int64_t i = 0; i < packets_a_type; ++i, ++total) {
      const Bytes bytes = Hostile(right, random);
      // The way of logs and operators' tools: counts unknown.
      T decoded{};
      if (DecodeChecked(bytes.data(), static_cast<int64_t>(bytes.size()), &decoded) &&
          !MessageTraits<T>::kHasStrings) {
        ASSERT_EQ(Encode(decoded), bytes);
      }
    }
    if constexpr (!MessageTraits<T>::kHasStrings) {
      Input<T> input;
      Wiring wiring;
      wiring.AddInput(&input, "in", SomeCounts<T>());
      Inbox inbox(&input, kRun);
      Channel channel;
      channel.set_name("C");
      channel.set_type(MessageTraits<T>::kName);
      for (const int32_t count : SomeCounts<T>()) channel.add_count(count);
      CollectedChannel collected(channel, kRun);
      for (int64_t i = 0; i < packets_a_type; ++i) {
        // Eight packets compete for each tick.
        message.tick = i / 8;
        if (i % 8 == 0) inbox.Want(message.tick);
        const Bytes base = Encode(message);
        const Bytes bytes = Hostile(base, random);
        const int64_t refused_before = inbox.counters().refused();
        const int64_t accepted_before = inbox.counters().accepted();
        inbox.Offer(bytes.data(), bytes.size());
        const bool accepted = inbox.counters().accepted() > accepted_before;
        ASSERT_EQ(inbox.counters().refused() - refused_before,
                  accepted ? 0 : 1);  // each is counted
        if (accepted) {
          ASSERT_EQ(bytes.size(), right.size());
          ASSERT_EQ(std::memcmp(bytes.data(), right.data(), MessageTraits<T>::kRunIdOffset + 8), 0);
        }
        const PacketVerdict verdict = collected.Offer(bytes.data(), bytes.size());
        if (verdict == PacketVerdict::kAccepted) {
          ASSERT_EQ(bytes.size(), right.size());
        }
        if (i % 8 == 7) {
          if (const uint8_t* kept = collected.Next()) {
            T delivered{};
            ASSERT_TRUE(DecodeChecked(kept, static_cast<int64_t>(collected.size()), &delivered));
            ASSERT_TRUE(MessageTraits<T>::AllFinite(delivered));
            ASSERT_EQ(delivered.tick, message.tick);
            ASSERT_EQ(delivered.run_id, kRun);
            ++total_collected;
          }
          collected.Advance();
        }
        if (!inbox.ready()) continue;
        inbox.Show(false);
        ASSERT_TRUE(MessageTraits<T>::AllFinite(*input));
        ASSERT_EQ(input->tick, message.tick);
        ASSERT_EQ(input->run_id, kRun);
      }
      EXPECT_GT(inbox.counters().accepted(), 0);
      EXPECT_GT(total_collected, 0);
      EXPECT_EQ(collected.counters().accepted() + collected.counters().refused(), packets_a_type);
      total_refused += inbox.counters().refused();
    }
  });
  EXPECT_GE(total, NumPackets());
  EXPECT_GT(total_refused, NumPackets() / 4);
  std::printf("%lld packets, %lld refused by a port\n", static_cast<long long>(2 * total),
              static_cast<long long>(total_refused));
}

TEST(PacketFuzz, TheServicePortActsOnlyOnItsOwnRunAndCountsTheRest) {
  Random random(TestSeed(11));
  RunSpec spec;
  spec.set_run_id(kRun);
  spec.mutable_graph()->add_component()->set_name("plant");
  ServiceFilter filter(spec);
  run_control_t control{};
  control.run_id = kRun;
  control.command = run_control_t::COMMAND_RESEND;
  health_t health{};
  health.run_id = kRun;
  health.component = "plant";
  health.detail = "fell at 1.2 s";
  const Bytes right_control = Encode(control);
  const Bytes right_health = Encode(health);
  int64_t accepted = 0;
  const int64_t rounds = NumPackets() / 4;
  for (int64_t i = 0; i < rounds; ++i) {
    const Bytes a = Hostile(right_control, random);
    run_control_t got{};
    if (filter.DecodeControl({"CONTROL", a.data(), a.size()}, &got)) {
      ++accepted;
      ASSERT_EQ(got.run_id, kRun);
      ASSERT_EQ(Encode(got), a);
    }
    const Bytes b = Hostile(right_health, random);
    const BusReceiver::Packet packet{"HEALTH_PLANT", b.data(), b.size()};
    accepted += filter.CheckHealth(packet);
    health_t seen{};
    if (filter.DecodeHealth(packet, &seen)) {
      ++accepted;
      ASSERT_EQ(seen.run_id, kRun);
      ASSERT_EQ(seen.component, "plant");
    }
  }
  EXPECT_GT(accepted, 0);
  EXPECT_EQ(filter.refused(), 3 * rounds - accepted);  // each is counted once
}

TEST(PacketFuzz, DatagramsOfAnyKindAreReadWithinTheirBounds) {
  Random random(TestSeed(7));
  const std::string text("LC02\0\0\0\1ROBOT_STATE\0some data of a message", 42);
  const Bytes right(text.begin(), text.end());
  int64_t parsed = 0;
  for (int64_t i = 0; i < NumPackets(); ++i) {
    const Bytes bytes = Hostile(right, random);
    BusReceiver::Packet packet;
    if (!ParseDatagram(bytes.data(), bytes.size(), &packet)) continue;
    ++parsed;
    ASSERT_LE(packet.channel.size(), 63u);
    ASSERT_EQ(packet.data + packet.size, bytes.data() + bytes.size());
  }
  EXPECT_GT(parsed, 0);
}

}  // namespace
}  // namespace poise
