// Where the fields of an encoded message stand: arrays are made of the bytes, without a message
// between.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/field_table.h"

namespace poise::python {

/// Kind of a field's numbers, as LCM encodes them: most significant byte first.
enum class Number { kInt8, kUint8, kInt16, kInt32, kInt64, kFloat, kDouble };

/// Bytes of one.
size_t SizeOf(Number number);

/// One field of numbers of a message, and of the structs in it: "foot_wrench.force" of two feet is
/// 2×3.
struct Leaf {
  std::string path;
  Number number = Number::kDouble;
  std::vector<int64_t> shape;    ///< empty: a single number
  std::vector<size_t> elements;  ///< bytes from the message's beginning, in C order
  std::string type;              ///< of the message
  std::vector<bool> indexed;     ///< by part of the path: whether it is an array

  /// "foot_wrench[0].force[2]" of each element, in C order.
  std::vector<std::string> Paths() const;
};

/// The fields of numbers of all messages of one type and counts.
class MessageLayout {
 public:
  /// Precondition: not type.has_strings; counts of the type's number, none negative.
  MessageLayout(const MessageType& type, std::span<const int32_t> counts);

  const std::vector<Leaf>& leaves() const { return leaves_; }
  /// nullptr when there is none of that path.
  const Leaf* Find(std::string_view path) const;
  size_t size() const { return size_; }  ///< bytes of a whole message

  /// Copies a leaf's numbers from a message of size() bytes, in this machine's order and in the
  /// leaf's own kind, to `to`.
  static void Read(const Leaf& leaf, const uint8_t* message, void* to);
  /// The reverse.
  static void Write(const Leaf& leaf, const void* from, uint8_t* message);

 private:
  void Add(std::string_view type, const std::string& prefix, const std::vector<int64_t>& shape,
           const std::vector<size_t>& bases, const std::vector<bool>& indexed);
  int64_t CountOf(const FieldInfo& field) const;
  size_t EncodedSize(std::string_view type) const;

  std::vector<std::pair<std::string, int32_t>> counts_;
  std::string type_;
  std::vector<Leaf> leaves_;
  size_t size_ = 0;
};

}  // namespace poise::python
