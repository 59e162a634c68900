// What the generated message traits share: walks over the fields of a message.
#pragma once

#include <cstdint>
#include <cstring>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace poise {

/// Specialised for every message type in "poise/message_traits.hpp" (generated).
template <class T>
struct MessageTraits;

/// Receives the scalars of a message in order. `path` is e.g. "foot_wrench[1].force[2]"; valid
/// during the call.
class ScalarVisitor {
 public:
  virtual ~ScalarVisitor() = default;
  virtual void Integer(std::string_view path, int64_t value) = 0;
  virtual void Real(std::string_view path, double value) = 0;
  virtual void Text(std::string_view path, std::string_view value) = 0;
};

/// One message type at run time: for tools that meet types by name or fingerprint (logs, echo,
/// replay).
struct MessageType {
  const char* name;  ///< "robot_state_t"; of another package than poise: "ankle.sway_t"
  int64_t fingerprint;
  std::span<const char* const> count_names;
  bool has_header;    ///< has run_id, tick, utime right after the counts
  bool has_strings;   ///< encoded size depends on more than the counts
  int run_id_offset;  ///< bytes from the start of the encoded message; tick at +8, utime at +16
  /// Size of every message with these counts; -1 when has_strings.
  int64_t (*encoded_size)(std::span<const int32_t> counts);
  /// Size of the message that `data` starts with, from its counts and string lengths; -1 when it
  /// does not fit in `size` bytes or is malformed. Bounds-checked, allocates nothing, does not look
  /// at the fingerprint.
  int64_t (*well_formed_size)(const uint8_t* data, int64_t size);
  /// Checks, decodes and visits every scalar. False (nothing visited) when the bytes are not such a
  /// message.
  bool (*visit)(const uint8_t* data, int64_t size, ScalarVisitor* visitor);
  /// A message with its arrays sized, and its end.
  void* (*make)(std::span<const int32_t> counts);
  void (*destroy)(void* message);
  /// Decodes into such a message; false when liblcm refuses it or a number in it is not finite.
  /// Does not allocate when `data` has its counts.
  bool (*decode)(const uint8_t* data, int size, void* message);
};

/// All message types: Poise's own by name, then others as they were added (AddMessages).
std::span<const MessageType> MessageTypes();
/// nullptr when there is no such type.
const MessageType* FindMessageType(std::string_view name);
const MessageType* FindMessageType(int64_t fingerprint);

namespace message_internal {

template <class F>
bool AllFinite(const F& field);

/// True when no exponent is all ones. Branch-free, so that it vectorises.
template <class Real, class Bits>
bool RealsFinite(const Real* values, size_t count, Bits exponent) {
  Bits bad = 0;
  for (size_t i = 0; i < count; ++i) {
    Bits bits;
    std::memcpy(&bits, values + i, sizeof(bits));
    bad = static_cast<Bits>(bad | static_cast<Bits>((bits & exponent) == exponent));
  }
  return bad == 0;
}

template <class E>
bool ElementsFinite(const E* values, size_t count) {
  if constexpr (std::is_same_v<E, double>) {
    return RealsFinite<double, uint64_t>(values, count, 0x7ff0000000000000u);
  } else if constexpr (std::is_same_v<E, float>) {
    return RealsFinite<float, uint32_t>(values, count, 0x7f800000u);
  } else if constexpr (std::is_integral_v<E> || std::is_same_v<E, std::string>) {
    return true;
  } else {
    for (size_t i = 0; i < count; ++i) {
      if (!MessageTraits<E>::AllFinite(values[i])) return false;
    }
    return true;
  }
}

template <class F>
struct IsVector : std::false_type {};
template <class E>
struct IsVector<std::vector<E>> : std::true_type {};

template <class F>
bool AllFinite(const F& field) {
  if constexpr (std::is_array_v<F>) {
    return ElementsFinite(field, std::extent_v<F>);
  } else if constexpr (IsVector<F>::value) {
    return ElementsFinite(field.data(), field.size());
  } else {
    return ElementsFinite(&field, 1);
  }
}

template <class F>
void VisitScalars(const F& field, std::string* path, ScalarVisitor* visitor) {
  const size_t length = path->size();
  if constexpr (std::is_array_v<F> || IsVector<F>::value) {
    for (size_t i = 0; i < std::size(field); ++i) {
      path->append("[").append(std::to_string(i)).append("]");
      VisitScalars(field[i], path, visitor);
      path->resize(length);
    }
  } else if constexpr (std::is_integral_v<F>) {
    visitor->Integer(*path, static_cast<int64_t>(field));
  } else if constexpr (std::is_floating_point_v<F>) {
    visitor->Real(*path, static_cast<double>(field));
  } else if constexpr (std::is_same_v<F, std::string>) {
    visitor->Text(*path, field);
  } else {
    MessageTraits<F>::VisitFields(field, [&](const char* name, const auto& member) {
      if (length != 0) path->append(".");
      path->append(name);
      VisitScalars(member, path, visitor);
      path->resize(length);
    });
  }
}

/// Walks an encoded message without decoding it.
class SizeWalker {
 public:
  SizeWalker(const uint8_t* data, int64_t size) : data_(data), size_(size) {}
  void Skip(int64_t bytes) {
    position_ = ok() && bytes <= size_ - position_ ? position_ + bytes : -1;
  }
  int32_t Count() {
    const int32_t value = Int32();
    if (value < 0) position_ = -1;
    return position_ < 0 ? 0 : value;
  }
  /// A string as LCM writes it: length with the terminating zero, then the bytes.
  void String() {
    const int32_t length = Int32();
    if (length < 1) position_ = -1;
    Skip(length);
  }
  int64_t position() const { return position_; }

 private:
  bool ok() const { return position_ >= 0; }
  int32_t Int32() {
    const int64_t at = position_;
    Skip(4);
    if (!ok()) return 0;
    const uint8_t* p = data_ + at;
    return static_cast<int32_t>(uint32_t{p[0]} << 24 | uint32_t{p[1]} << 16 | uint32_t{p[2]} << 8 |
                                uint32_t{p[3]});
  }

  const uint8_t* data_;
  int64_t size_;
  int64_t position_ = 0;
};

template <class T>
bool DecodeAndVisit(const uint8_t* data, int64_t size, ScalarVisitor* visitor);

}  // namespace message_internal

/// Visits every scalar of `message` (counts included) in the order of declaration.
template <class T>
void VisitScalars(const T& message, ScalarVisitor* visitor) {
  std::string path;
  message_internal::VisitScalars(message, &path, visitor);
}

/// Decodes one whole message of unknown counts (from a log, from an operator): size, counts and
/// strings are checked before liblcm sees them. False when `data` is not exactly one T. May
/// allocate; not for the tick path.
template <class T>
bool DecodeChecked(const uint8_t* data, int64_t size, T* message) {
  return size <= INT32_MAX && MessageTraits<T>::WellFormedSize(data, size) == size &&
         message->decode(data, 0, static_cast<int>(size)) == size;
}

template <class T>
bool DecodeChecked(std::span<const uint8_t> data, T* message) {
  return DecodeChecked(data.data(), std::ssize(data), message);
}

/// The message as it is sent. Allocates.
template <class T>
std::vector<uint8_t> MessageBytes(const T& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// What is known of T at run time.
template <class T>
MessageType MessageTypeOf() {
  using Traits = MessageTraits<T>;
  return {Traits::kName,
          T::getHash(),
          Traits::kCountNames,
          Traits::kHasHeader,
          Traits::kHasStrings,
          Traits::kRunIdOffset,
          &Traits::EncodedSize,
          &Traits::WellFormedSize,
          &message_internal::DecodeAndVisit<T>,
          [](std::span<const int32_t> counts) -> void* {
            auto* const message = new T();
            Traits::Resize(*message, counts);
            return message;
          },
          [](void* message) { delete static_cast<T*>(message); },
          [](const uint8_t* data, int size, void* message) {
            auto& m = *static_cast<T*>(message);
            return m.decode(data, 0, size) == size && Traits::AllFinite(m);
          }};
}

template <class T>
bool message_internal::DecodeAndVisit(const uint8_t* data, int64_t size, ScalarVisitor* visitor) {
  T message{};
  if (!DecodeChecked(data, size, &message)) return false;
  poise::VisitScalars(message, visitor);
  return true;
}

}  // namespace poise
