// What the generator says of every message, against what liblcm's own code does with it.
#include "poise/message_traits.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "tests/every_message.h"
#include "tests/test_seed.h"

namespace poise {
namespace {

using ::testing::ElementsAre;

template <class T>
std::vector<int32_t> SomeCounts() {
  const std::map<std::string, int32_t> values = {
      {"num_joints", 5}, {"num_feet", 2}, {"num_motors", 3}, {"num_slaves", 6}};
  std::vector<int32_t> counts;
  for (const char* name : MessageTraits<T>::kCountNames) counts.push_back(values.at(name));
  return counts;
}

/// Calls f(leaf&) for every scalar or string of a message, counts included.
template <class F, class Leaf>
void ForEachLeaf(F& field, const Leaf& leaf) {
  if constexpr (std::is_array_v<F> || message_internal::IsVector<F>::value) {
    for (auto& element : field) ForEachLeaf(element, leaf);
  } else if constexpr (std::is_arithmetic_v<F> || std::is_same_v<F, std::string>) {
    leaf(field);
  } else {
    MessageTraits<F>::VisitFields(field,
                                  [&](const char*, auto& member) { ForEachLeaf(member, leaf); });
  }
}

/// Random values everywhere but in the counts.
template <class T>
T RandomMessage(std::mt19937_64* random) {
  T message{};
  MessageTraits<T>::Resize(message, SomeCounts<T>());
  int leaf_index = 0;
  ForEachLeaf(message, [&](auto& leaf) {
    using L = std::remove_reference_t<decltype(leaf)>;
    if (leaf_index++ < MessageTraits<T>::kNumCounts) return;
    if constexpr (std::is_same_v<L, std::string>) {
      leaf = std::string((*random)() % 20, 'x');
    } else if constexpr (std::is_floating_point_v<L>) {
      leaf = static_cast<L>(std::normal_distribution<double>(0, 1e3)(*random));
    } else {
      leaf = static_cast<L>((*random)());
    }
  });
  return message;
}

template <class T>
std::vector<uint8_t> Encode(const T& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  EXPECT_EQ(message.encode(bytes.data(), 0, static_cast<int>(bytes.size())),
            static_cast<int>(bytes.size()));
  return bytes;
}

TEST(MessageTraits, RoundTripOfEveryType) {
  std::mt19937_64 random(TestSeed(1));
  int types = 0;
  ForEveryType([&]<class T>() {
    SCOPED_TRACE(MessageTraits<T>::kName);
    ++types;
    const T message = RandomMessage<T>(&random);
    const std::vector<uint8_t> bytes = Encode(message);
    T decoded{};
    MessageTraits<T>::Resize(decoded, SomeCounts<T>());
    ASSERT_EQ(decoded.decode(bytes.data(), 0, static_cast<int>(bytes.size())),
              static_cast<int>(bytes.size()));
    EXPECT_EQ(Encode(decoded), bytes);
  });
  EXPECT_EQ(types, static_cast<int>(MessageTypes().size()));
  EXPECT_GE(types, 14);
}

TEST(MessageTraits, ResizeZeroesWhatWasThere) {
  std::mt19937_64 random(TestSeed(2));
  ForEveryType([&]<class T>() {
    SCOPED_TRACE(MessageTraits<T>::kName);
    T message = RandomMessage<T>(&random);
    const std::vector<int32_t> counts = SomeCounts<T>();
    MessageTraits<T>::Resize(message, counts);
    size_t index = 0;
    ForEachLeaf(message, [&](auto& leaf) {
      using L = std::remove_reference_t<decltype(leaf)>;
      if constexpr (std::is_same_v<L, std::string>) {
        EXPECT_TRUE(leaf.empty());
      } else if (index < counts.size()) {
        EXPECT_EQ(static_cast<int32_t>(leaf), counts[index]);
      } else {
        EXPECT_EQ(leaf, L{});
      }
      ++index;
    });
  });
}

TEST(MessageTraits, AllFiniteFindsEveryBadNumber) {
  std::mt19937_64 random(TestSeed(3));
  ForEveryType([&]<class T>() {
    SCOPED_TRACE(MessageTraits<T>::kName);
    T message = RandomMessage<T>(&random);
    EXPECT_TRUE(MessageTraits<T>::AllFinite(message));
    std::vector<double*> reals;
    ForEachLeaf(message, [&](auto& leaf) {
      if constexpr (std::is_same_v<std::remove_reference_t<decltype(leaf)>, double>)
        reals.push_back(&leaf);
    });
    for (double* real : reals) {
      const double kept = *real;
      for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(),
                               -std::numeric_limits<double>::infinity()}) {
        *real = bad;
        EXPECT_FALSE(MessageTraits<T>::AllFinite(message)) << "number " << real - reals[0];
      }
      for (const double good : {0.0, -0.0, std::numeric_limits<double>::max(),
                                std::numeric_limits<double>::denorm_min()}) {
        *real = good;
        EXPECT_TRUE(MessageTraits<T>::AllFinite(message));
      }
      *real = kept;
    }
  });
}

TEST(MessageTraits, SizesAgreeWithLiblcm) {
  std::mt19937_64 random(TestSeed(4));
  ForEveryType([&]<class T>() {
    using Traits = MessageTraits<T>;
    SCOPED_TRACE(Traits::kName);
    const std::vector<uint8_t> bytes = Encode(RandomMessage<T>(&random));
    const auto size = static_cast<int64_t>(bytes.size());
    EXPECT_EQ(Traits::EncodedSize(SomeCounts<T>()), Traits::kHasStrings ? -1 : size);
    EXPECT_EQ(Traits::WellFormedSize(bytes.data(), size), size);
    for (int64_t cut = 0; cut < size; ++cut) {
      const std::vector<uint8_t> shorter(bytes.begin(),
                                         bytes.begin() + cut);  // own block: overruns show
      ASSERT_EQ(Traits::WellFormedSize(shorter.data(), cut), -1) << cut;
      T decoded{};
      ASSERT_FALSE(DecodeChecked(shorter.data(), cut, &decoded));
    }
  });
}

TEST(MessageTraits, HostileCountsAndLengthsAreRefusedBeforeDecoding) {
  std::mt19937_64 random(TestSeed(5));
  ForEveryType([&]<class T>() {
    using Traits = MessageTraits<T>;
    SCOPED_TRACE(Traits::kName);
    const std::vector<uint8_t> bytes = Encode(RandomMessage<T>(&random));
    for (size_t count = 0; count < static_cast<size_t>(Traits::kNumCounts); ++count) {
      for (const uint32_t hostile :
           {0xffffffffu, 0x80000000u, 0x10000000u, 0x20000000u, 0x7fffffffu, 4u}) {
        std::vector<uint8_t> damaged = bytes;
        for (size_t i = 0; i < 4; ++i)
          damaged[8 + 4 * count + i] = static_cast<uint8_t>(hostile >> (24 - 8 * i));
        T decoded{};
        EXPECT_FALSE(DecodeChecked(damaged.data(), static_cast<int64_t>(damaged.size()), &decoded))
            << hostile;
      }
    }
  });
  health_t health{};
  health.component = "sim";
  std::vector<uint8_t> bytes = Encode(health);
  for (const uint8_t first : {uint8_t{0x80}, uint8_t{0x7f}, uint8_t{0xff}}) {
    bytes[8 + 24 + 1] = first;  // top byte of the length of `component`
    EXPECT_FALSE(DecodeChecked(bytes.data(), static_cast<int64_t>(bytes.size()), &health));
  }
}

TEST(MessageTraits, HeaderStandsWhereTheTableSays) {
  std::mt19937_64 random(TestSeed(6));
  ForEveryType([&]<class T>() {
    SCOPED_TRACE(MessageTraits<T>::kName);
    T message = RandomMessage<T>(&random);
    message.run_id = 0x0102030405060708;
    message.tick = 0x1112131415161718;
    const std::vector<uint8_t> bytes = Encode(message);
    for (int i = 0; i < 8; ++i) {
      EXPECT_EQ(bytes[static_cast<size_t>(MessageTraits<T>::kRunIdOffset + i)], 1 + i);
      EXPECT_EQ(bytes[static_cast<size_t>(MessageTraits<T>::kRunIdOffset + 8 + i)], 0x11 + i);
    }
  });
}

TEST(MessageTable, NamesAndFingerprintsAreUniqueAndFound) {
  std::set<std::string> names;
  std::set<int64_t> fingerprints;
  for (const MessageType& type : MessageTypes()) {
    EXPECT_TRUE(names.insert(type.name).second) << type.name;
    // liblcm's fingerprint ignores the type's name: two types with the same fields could not be
    // told apart.
    EXPECT_TRUE(fingerprints.insert(type.fingerprint).second) << type.name;
    EXPECT_EQ(FindMessageType(type.name), &type);
    EXPECT_EQ(FindMessageType(type.fingerprint), &type);
    EXPECT_TRUE(type.has_header);
  }
  EXPECT_EQ(FindMessageType("wrench_t"), nullptr);  // a field's type only
  EXPECT_EQ(FindMessageType(int64_t{12345}), nullptr);
  EXPECT_THAT(std::vector<std::string>(FindMessageType("robot_state_t")->count_names.begin(),
                                       FindMessageType("robot_state_t")->count_names.end()),
              ElementsAre("num_joints", "num_feet"));
}

class Recorder final : public ScalarVisitor {
 public:
  void Integer(std::string_view path, int64_t value) override {
    integers[std::string(path)] = value;
  }
  void Real(std::string_view path, double value) override { reals[std::string(path)] = value; }
  void Text(std::string_view path, std::string_view value) override {
    texts[std::string(path)] = value;
  }
  std::map<std::string, int64_t> integers;
  std::map<std::string, double> reals;
  std::map<std::string, std::string> texts;
};

TEST(MessageTable, VisitsEveryScalarByPath) {
  balance_torque_t message{};
  MessageTraits<balance_torque_t>::Resize(message, std::vector<int32_t>{3, 2});
  message.tick = 7;
  message.torque = {1, 2, 3};
  message.in_contact = {1, -1};
  message.foot_wrench[1].moment[2] = 4.5;
  message.frame_o.orientation[0] = 1;
  const std::vector<uint8_t> bytes = Encode(message);
  Recorder seen;
  const MessageType* type = FindMessageType(balance_torque_t::getHash());
  ASSERT_TRUE(type->visit(bytes.data(), static_cast<int64_t>(bytes.size()), &seen));
  EXPECT_EQ(seen.integers.at("num_joints"), 3);
  EXPECT_EQ(seen.integers.at("tick"), 7);
  EXPECT_EQ(seen.integers.at("in_contact[1]"), -1);
  EXPECT_EQ(seen.reals.at("torque[2]"), 3);
  EXPECT_EQ(seen.reals.at("foot_wrench[1].moment[2]"), 4.5);
  EXPECT_EQ(seen.reals.at("frame_o.orientation[0]"), 1);
  // 8 bytes a real: what is not counted or integer is real.
  EXPECT_EQ(seen.reals.size(), 3u + 3u + 7u + 2u + 2u + 2u + 6u + 6u + 2u * 6u + 5u + 2u * 16u);
  EXPECT_FALSE(type->visit(bytes.data(), static_cast<int64_t>(bytes.size()) - 1, &seen));

  health_t health{};
  health.detail = "robot fell";
  const std::vector<uint8_t> health_bytes = Encode(health);
  ASSERT_TRUE(FindMessageType("health_t")
                  ->visit(health_bytes.data(), static_cast<int64_t>(health_bytes.size()), &seen));
  EXPECT_EQ(seen.texts.at("detail"), "robot fell");
}

}  // namespace
}  // namespace poise
