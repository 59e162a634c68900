// StateArchive: a component's state as bytes, for the process that takes over from one that died.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace poise {

class StateArchive;

/// What shows its own state.
template <class T>
concept Archived = requires(T& value, StateArchive* archive) {
  value.Archive(archive);
};

/// Walks over values and measures, saves or restores them, in the order shown. The structure (sizes
/// of arrays) must be the same when saving and restoring; a restore into another structure, or with
/// too few bytes, fails and leaves the rest untouched. Never allocates or throws.
class StateArchive {
 public:
  /// Only measures.
  StateArchive() = default;
  static StateArchive Saving(std::span<uint8_t> bytes) {
    return {Mode::kSave, bytes.data(), bytes.size()};
  }
  static StateArchive Restoring(std::span<const uint8_t> bytes) {
    // Never written to in this mode.
    return {Mode::kRestore, const_cast<uint8_t*>(bytes.data()), bytes.size()};
  }

  template <Archived T>
  void Show(T& value) {
    value.Archive(this);
  }
  /// Values without pointers: numbers, enums, and structs of them.
  template <class T>
  requires std::is_trivially_copyable_v<T> &&
      (!std::is_pointer_v<T>)&&(!Archived<T>)void Show(T& value) {
    Bytes(&value, sizeof value);
  }
  /// `values` has the same length when it is restored.
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void Show(std::vector<T>& values) {
    if (SameSize(values.size())) Bytes(values.data(), values.size() * sizeof(T));
  }
  /// Eigen matrices, arrays and quaternions, of fixed or dynamic size; of the same size when
  /// restored.
  template <class T>
  requires(!std::is_trivially_copyable_v<T>) && requires(T& t) {
    t.data();
    t.rows();
    t.cols();
  }
  void Show(T& value) {
    const auto size = static_cast<size_t>(value.rows() * value.cols());
    if (SameSize(size)) Bytes(value.data(), size * sizeof(typename T::Scalar));
  }
  template <class Scalar, int Dimension, int Mode, int Options>
  void Show(Eigen::Transform<Scalar, Dimension, Mode, Options>& value) {
    Show(value.matrix());  // its rows() and cols() leave out the last row
  }
  template <class Scalar, int Options>
  void Show(Eigen::Quaternion<Scalar, Options>& value) {
    Show(value.coeffs());
  }
  /// `values` has the same length when it is restored.
  template <class T>
  requires(!std::is_trivially_copyable_v<T>) void Show(std::vector<T>& values) {
    if (!SameSize(values.size())) return;
    for (T& value : values) Show(value);
  }
  template <class T, size_t N>
  requires(!std::is_trivially_copyable_v<T>) void Show(std::array<T, N>& values) {
    for (T& value : values) Show(value);
  }
  // Two at least: a class derived from std::array would else be taken for one, for ever.
  template <class T, class U, class... More>
  void Show(T& first, U& second, More&... more) {
    Show(first);
    Show(second, more...);
  }

  /// Bytes shown so far.
  size_t size() const { return size_; }
  /// False once something did not fit.
  bool ok() const { return ok_; }
  bool restoring() const { return mode_ == Mode::kRestore; }

 private:
  enum class Mode : uint8_t { kMeasure, kSave, kRestore };
  StateArchive(Mode mode, uint8_t* bytes, size_t capacity)
      : mode_(mode), bytes_(bytes), capacity_(capacity) {}

  bool SameSize(size_t size) {
    uint64_t stored = size;
    Bytes(&stored, sizeof stored);
    ok_ = ok_ && stored == size;
    return ok_;
  }
  void Bytes(void* value, size_t count) {
    ok_ = ok_ && (mode_ == Mode::kMeasure || count <= capacity_ - size_);
    if (!ok_) return;
    if (mode_ == Mode::kSave) std::memcpy(bytes_ + size_, value, count);
    if (mode_ == Mode::kRestore) std::memcpy(value, bytes_ + size_, count);
    size_ += count;
  }

  Mode mode_ = Mode::kMeasure;
  uint8_t* bytes_ = nullptr;
  size_t capacity_ = 0;
  size_t size_ = 0;
  bool ok_ = true;
};

}  // namespace poise
