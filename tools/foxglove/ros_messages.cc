#include "tools/foxglove/ros_messages.h"

#include <bit>
#include <cstring>

namespace poise {
namespace {

/// OMG's Common Data Representation, plain, little-endian: each number aligned to its size from the
/// end of the four-byte header on.
class Cdr {
 public:
  Cdr() : bytes_("\0\1\0\0", kHeader) {}

  template <class Number>
  void Add(Number value) {
    static_assert(std::endian::native == std::endian::little);
    while ((bytes_.size() - kHeader) % sizeof(Number) != 0) bytes_ += '\0';
    char raw[sizeof(Number)];
    std::memcpy(raw, &value, sizeof(Number));
    bytes_.append(raw, sizeof(Number));
  }
  /// Its length counts the zero at its end.
  void AddText(std::string_view text) {
    Add(static_cast<uint32_t>(text.size() + 1));
    bytes_.append(text);
    bytes_ += '\0';
  }
  void AddNumbers(std::span<const double> values) {
    Add(static_cast<uint32_t>(values.size()));
    for (const double value : values) Add(value);
  }
  std::string Take() { return std::move(bytes_); }

 private:
  static constexpr size_t kHeader = 4;
  std::string bytes_;
};

}  // namespace

const std::string_view kJointStateDefinition =
    "std_msgs/Header header\n"
    "string[] name\n"
    "float64[] position\n"
    "float64[] velocity\n"
    "float64[] effort\n"
    "================================================================================\n"
    "MSG: std_msgs/Header\n"
    "builtin_interfaces/Time stamp\n"
    "string frame_id\n"
    "================================================================================\n"
    "MSG: builtin_interfaces/Time\n"
    "int32 sec\n"
    "uint32 nanosec\n";

std::string StringCdr(std::string_view text) {
  Cdr cdr;
  cdr.AddText(text);
  return cdr.Take();
}

std::string JointStateCdr(int64_t utime, std::span<const std::string> names,
                          std::span<const double> position, std::span<const double> velocity,
                          std::span<const double> effort) {
  Cdr cdr;
  cdr.Add(static_cast<int32_t>(utime / 1'000'000));
  cdr.Add(static_cast<uint32_t>(utime % 1'000'000) * 1'000);
  cdr.AddText("");
  cdr.Add(static_cast<uint32_t>(names.size()));
  for (const std::string& name : names) cdr.AddText(name);
  cdr.AddNumbers(position);
  cdr.AddNumbers(velocity);
  cdr.AddNumbers(effort);
  return cdr.Take();
}

}  // namespace poise
