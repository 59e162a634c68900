// States as bytes on the wire that no robot would send: CycloneDDS makes a sample of them or none,
// the bridge takes what is whole and new, and nothing outside limits leaves it.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <random>
#include <set>
#include <span>
#include <vector>

#include "dds/ddsi/ddsi_serdata.h"
#include "hw_bridge/unitree/dds.h"
#include "tests/hw_bridge/unitree/robot_rig.h"

namespace poise {
namespace {

using unitree::LowState;

// Bytes of a state in the Common Data Representation (OMG, formal/2021-11-03, 7.4.1), written out:
// an encapsulation header of 4; then each number at a multiple of its size.
constexpr size_t kHeader = 4;
constexpr size_t kTick = kHeader + 12;  // after version, mode_pr, mode_machine, two of padding
constexpr size_t kImu = kHeader + 16;
constexpr size_t kMotors0 = kImu + 4 * (4 + 3 + 3 + 3) + 2;  // its temperature is a short
constexpr size_t kFirstQ = (kMotors0 - kHeader + 1 + 3) / 4 * 4 + kHeader;
constexpr size_t kMotorSize = 4 + 4 * 4 + 2 * 2 + 4 + 2 * 4 + 4 + 4 * 4;
constexpr size_t kEndOfMotors = kFirstQ - 4 + unitree::kNumSlots * kMotorSize;
constexpr size_t kCrc = kEndOfMotors + 40 + 4 * 4;
constexpr size_t kSize = kCrc + 4;

template <class T>
T At(std::span<const uint8_t> bytes, size_t position) {
  T value;
  std::memcpy(&value, &bytes[position], sizeof(T));
  return value;
}

/// What CycloneDDS does with the bytes of a sample that has come.
class Wire {
 public:
  Wire() : participant_(Loopback()) {
    dds_qos_t* const qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    const dds_entity_t topic =
        dds_create_topic(participant_.entity(), unitree::kDescriptor<LowState>,
                         unitree::kStateTopic, nullptr, nullptr);
    const dds_entity_t reader = dds_create_reader(participant_.entity(), topic, qos, nullptr);
    const dds_entity_t writer = dds_create_writer(participant_.entity(), topic, qos, nullptr);
    dds_delete_qos(qos);
    const LowState state{};
    dds_write(writer, &state);
    dds_sample_info_t info;
    // A sample tells its type, by which others are made.
    for (int i = 0; i < 1000 && known_ == nullptr; ++i) {
      if (dds_takecdr(reader, &known_, 1, &info, DDS_ANY_STATE) < 1) dds_sleepfor(DDS_MSECS(10));
    }
  }
  ~Wire() {
    if (known_ != nullptr) ddsi_serdata_unref(known_);
  }
  bool open() const { return known_ != nullptr; }

  std::vector<uint8_t> Bytes(const LowState& state) const {
    ddsi_serdata* const made = ddsi_serdata_from_sample(known_->type, SDK_DATA, &state);
    std::vector<uint8_t> bytes(ddsi_serdata_size(made));
    ddsi_serdata_to_ser(made, 0, bytes.size(), bytes.data());
    ddsi_serdata_unref(made);
    return bytes;
  }
  /// False: they are no state.
  bool Read(const std::vector<uint8_t>& bytes, LowState* state) const {
    // The copy has that size and no byte more, so that a sanitizer sees who reads beyond it.
    const std::unique_ptr<uint8_t[]> exact(new uint8_t[bytes.size()]);
    std::copy(bytes.begin(), bytes.end(), exact.get());
    const ddsrt_iovec_t place = {exact.get(), bytes.size()};
    ddsi_serdata* const made =
        ddsi_serdata_from_ser_iov(known_->type, SDK_DATA, 1, &place, bytes.size());
    if (made == nullptr) return false;
    const bool read = ddsi_serdata_to_sample(made, state, nullptr, nullptr);
    ddsi_serdata_unref(made);
    return read;
  }

 private:
  static unitree::DdsLink Loopback() {
    unitree::DdsLink link;
    link.set_tag(fmt::format("poise-fuzz-{}", getpid()));
    link.set_domain(3);
    return link;
  }
  unitree::Participant participant_;
  ddsi_serdata* known_ = nullptr;
};

TEST(UnitreeStateFuzz, BytesAreWhereTheStandardPutsThem) {
  const Wire wire;
  ASSERT_TRUE(wire.open());
  LowState state{};
  state.tick = 0x01020304;
  state.motor_state[0].q = 0.25F;
  state.motor_state[34].q = -3;
  state.crc = 0xA0B0C0D0;
  const std::vector<uint8_t> bytes = wire.Bytes(state);
  ASSERT_EQ(bytes.size(), kSize);
  EXPECT_EQ(At<uint16_t>(bytes, 0), 0x0100) << "little-endian: 00 01";
  EXPECT_EQ(At<uint32_t>(bytes, kTick), state.tick);
  EXPECT_EQ(At<float>(bytes, kFirstQ), 0.25F);
  EXPECT_EQ(At<float>(bytes, kFirstQ + 34 * kMotorSize), -3);
  EXPECT_EQ(At<uint32_t>(bytes, kCrc), state.crc);
  LowState read{};
  ASSERT_TRUE(wire.Read(bytes, &read));
  EXPECT_EQ(read.motor_state[34].q, -3);
  for (size_t size = 0; size < kSize; ++size) {
    const std::vector<uint8_t> part(bytes.begin(), bytes.begin() + static_cast<int64_t>(size));
    EXPECT_FALSE(wire.Read(part, &read)) << size;
  }
}

enum Mutation { kNone, kBytes, kNumbers, kShorter, kLonger, kHead, kOrder, kNumMutations };

/// Changes `bytes`; a quarter of what had a right check sum keeps one.
void MutateBytes(Mutation mutation, std::mt19937* random, std::vector<uint8_t>* bytes) {
  const auto any = [&](size_t below) { return static_cast<size_t>((*random)()) % below; };
  const uint32_t numbers[] = {0x7FC00000, 0xFF800000, 0x7F7FFFFF, 0xFFFFFFFF, 0, 0x80000000};
  const size_t count = 1 + any(8);
  switch (mutation) {
    case kBytes:
      for (size_t i = 0; i < count; ++i) {
        (*bytes)[kHeader + any(kSize - kHeader)] = static_cast<uint8_t>((*random)());
      }
      break;
    case kNumbers:
      for (size_t i = 0; i < count; ++i) {
        std::memcpy(&(*bytes)[kHeader + 4 * any((kSize - kHeader) / 4)], &numbers[any(6)], 4);
      }
      break;
    case kShorter:
      bytes->resize(any(kSize));
      break;
    case kLonger:
      bytes->resize(kSize + 1 + any(3000), static_cast<uint8_t>((*random)()));
      break;
    case kHead:
      (*bytes)[any(kHeader)] = static_cast<uint8_t>((*random)());
      break;
    case kOrder: {
      const auto tick = At<uint32_t>(*bytes, kTick);
      const uint32_t ticks[] = {tick - 2,          tick - 4,
                                tick + 1000,       tick + 0x7FFFFFFF,
                                tick + 0x80000000, static_cast<uint32_t>((*random)())};
      std::memcpy(&(*bytes)[kTick], &ticks[any(6)], 4);
      break;
    }
    default:
      break;
  }
}

TEST(UnitreeStateFuzz, WhatIsWholeAndNewIsTakenAndCommandsStayWithinLimits) {
  const Wire wire;
  ASSERT_TRUE(wire.open());
  std::mt19937 random(17);
  std::unique_ptr<RobotRig> rig;
  LowState said{};
  uint32_t newest = 0;
  const auto begin = [&] {
    rig = std::make_unique<RobotRig>("drives_hold: true on_lost_command: HOLD");
    rig->Start(5);
    newest = rig->robot.state.tick;
    rig->robot.verbatim = &said;
  };
  begin();
  int64_t taken = 0, left = 0, judged = 0, stops = 0;
  std::set<int8_t> reasons;
  for (int i = 0; i < FuzzSamples(); ++i) {
    // Mostly what a robot says, so that it is in motion when something else comes.
    const auto mutation =
        random() % 3 == 0 ? static_cast<Mutation>(random() % kNumMutations) : kNone;
    LowState state = rig->robot.state;
    state.tick = newest + 2;
    state.crc = unitree::CrcOf(state);
    std::vector<uint8_t> bytes = wire.Bytes(state);
    MutateBytes(mutation, &random, &bytes);
    bool heard = wire.Read(bytes, &said);
    if (heard && random() % 4 != 0 && bytes.size() >= kSize) {
      // Damaged before its check sum was made.
      said.crc = unitree::CrcOf(said);
      std::memcpy(&bytes[kCrc], &said.crc, 4);
      heard = wire.Read(bytes, &said);
    }
    ASSERT_TRUE(heard || mutation == kShorter || mutation == kHead) << mutation;
    ASSERT_FALSE(heard && bytes.size() < kSize);
    if (heard && mutation != kHead) {
      ASSERT_EQ(said.tick, At<uint32_t>(bytes, kTick));
      ASSERT_EQ(said.crc, At<uint32_t>(bytes, kCrc));
    }
    // Serial number arithmetic, RFC 1982: the half of all numbers that follow are newer.
    const bool newer = said.tick != newest && said.tick - newest < 0x80000000;
    const bool takes = heard && newer && said.crc == unitree::CrcOf(said);
    rig->robot.silent = !heard;
    const auto runs = [&] {
      const int8_t now = rig->status().state;
      return now >= bridge_status_t::STATE_RUNNING && now < bridge_status_t::STATE_STOPPING;
    };
    const bool ran = runs();
    const int64_t lost = rig->status().frames_lost;
    rig->command.stiffness.assign(kMotors, random() % 3 == 0 ? 50 : 0);
    rig->Step(random() % 10 != 0);
    if (ran && runs()) {
      ++judged;
      ASSERT_EQ(rig->status().frames_lost - lost, takes ? 0 : 1) << mutation << ' ' << said.tick;
    }
    if (takes) newest = said.tick;
    ++(takes ? taken : left);
    ASSERT_EQ(rig->Broken(), "") << mutation;
    if (!rig->TakeWithheld()) {
      const robot_sensors_t& readings = rig->readings();
      for (size_t j = 0; j < kMotors; ++j) {
        ASSERT_TRUE(std::isfinite(readings.joint_position[j] + readings.joint_torque[j]))
            << mutation;
      }
    }
    if (rig->status().state < bridge_status_t::STATE_STOPPED) continue;
    reasons.insert(rig->status().reason);
    // Stopped it hears on for a while.
    if (random() % 4 != 0) continue;
    ++stops;
    begin();
  }
  EXPECT_GT(taken, FuzzSamples() / 2);
  EXPECT_GT(left, FuzzSamples() / 20);
  EXPECT_GT(judged, FuzzSamples() / 4);
  EXPECT_GT(stops, FuzzSamples() / 200);
  EXPECT_GE(reasons.size(), 4U);
}

}  // namespace
}  // namespace poise
