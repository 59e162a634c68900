// DDS by CycloneDDS's C interface: a participant, and readers and writers of a topic each.
#pragma once

#include <dds/dds.h>

#include <cstdint>
#include <memory>

#include "hw_bridge/unitree/messages.h"
#include "hw_bridge/unitree/unitree.pb.h"

namespace poise::unitree {

/// Takes part in a domain, on one network interface, until it is destroyed. CYCLONEDDS_URI has no
/// say. Participants of one process share a domain's configuration, which must be the same.
class Participant {
 public:
  /// Throws UnitreeError.
  explicit Participant(const DdsLink& link);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  dds_entity_t entity() const { return entity_; }

 private:
  class Domain;
  std::shared_ptr<Domain> domain_;
  dds_entity_t entity_ = 0;
};

/// What readers and writers of any type have in common.
class Endpoint {
 public:
  ~Endpoint();
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

 protected:
  enum class Kind { kReader, kWriter };
  /// Reliable where writing; samples kept: `depth`. Throws UnitreeError.
  Endpoint(const Participant& participant, Kind kind, const dds_topic_descriptor_t& type,
           const char* topic, int32_t depth);
  bool WriteSample(const void* sample) { return dds_write(entity_, sample) == DDS_RETCODE_OK; }
  /// `sent`, unless null: when its writer gave it away, ns since the epoch by the writer's clock.
  bool TakeSample(void* sample, int64_t* sent);
  /// Waits until a sample is there, at most until `deadline` of NowNanoseconds. True: there is one.
  bool AwaitSample(int64_t deadline);

 private:
  dds_entity_t topic_ = 0, entity_ = 0, waitset_ = 0;
};

/// Type descriptor of a message; null of a type that Unitree does not send.
template <class T>
inline constexpr const dds_topic_descriptor_t* kDescriptor = nullptr;
template <>
inline constexpr const dds_topic_descriptor_t* kDescriptor<LowCmd> =
    &unitree_hg_msg_dds__LowCmd__desc;
template <>
inline constexpr const dds_topic_descriptor_t* kDescriptor<LowState> =
    &unitree_hg_msg_dds__LowState__desc;
template <>
inline constexpr const dds_topic_descriptor_t* kDescriptor<ImuState> =
    &unitree_hg_msg_dds__IMUState__desc;
template <>
inline constexpr const dds_topic_descriptor_t* kDescriptor<Request> =
    &unitree_api_msg_dds__Request__desc;
template <>
inline constexpr const dds_topic_descriptor_t* kDescriptor<Response> =
    &unitree_api_msg_dds__Response__desc;

template <class T>
class Writer : private Endpoint {
  static_assert(kDescriptor<T> != nullptr);

 public:
  Writer(const Participant& participant, const char* topic, int32_t depth = 1)
      : Endpoint(participant, Kind::kWriter, *kDescriptor<T>, topic, depth) {}
  /// False when it could not be handed over within a millisecond.
  bool Write(const T& sample) { return WriteSample(&sample); }
};

/// Reads messages without strings and sequences, or with: those of `sample` are replaced.
template <class T>
class Reader : private Endpoint {
  static_assert(kDescriptor<T> != nullptr);

 public:
  Reader(const Participant& participant, const char* topic, int32_t depth = 1)
      : Endpoint(participant, Kind::kReader, *kDescriptor<T>, topic, depth) {}
  /// The next sample that has come, if there is one. `sent`, where given: when its writer gave it
  /// away, ns since the epoch by the writer's clock.
  bool Take(T* sample, int64_t* sent = nullptr) { return TakeSample(sample, sent); }
  /// Whether there is one, at the latest at the deadline of NowNanoseconds.
  bool Await(int64_t deadline) { return AwaitSample(deadline); }
};

}  // namespace poise::unitree
