// ObjectDictionary: the objects of an emulated CoE slave, and who may do what with them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "hw_bridge/ethercat/coe.h"

namespace poise::ethercat {

class ObjectDictionary {
 public:
  enum Access : uint8_t {
    kReadOnly = 0,
    kWritable = 1,
    kRxMappable = 2,  ///< into a PDO that the master sends
    kTxMappable = 4,  ///< into a PDO that the slave sends
  };
  struct Object {
    uint8_t size = 4;  ///< bytes, 1 to 4; 0: a text
    uint8_t access = kReadOnly;
    uint32_t value = 0;
    std::string name = {};   ///< what SDO information calls the index; of its first object
    std::string text = {};   ///< of size 0
    size_t most_text = 0;    ///< bytes that a writable text takes
    bool is_signed = false;  ///< its data type
    /// Asked before the master's write; refuses with other than kNone.
    std::function<SdoAbort(uint32_t value)> on_write = {};

    size_t bytes() const { return size > 0 ? size : text.size(); }
    /// Number of its basic data type (ETG.1000.6, table 64): 0x0005 UNSIGNED8, 0x0009 a text, ...
    uint16_t data_type() const;
  };

  /// Adds or replaces an object; the address of the result stays valid.
  Object* Add(ObjectAddress address, uint8_t size, uint8_t access, uint32_t value = 0,
              std::function<SdoAbort(uint32_t)> on_write = nullptr);
  Object* AddText(ObjectAddress address, std::string text, size_t most = 0);
  /// Returns the name of the index, or one made of its number.
  std::string NameOf(uint16_t index) const;
  /// nullptr when there is none.
  const Object* Find(ObjectAddress address) const;
  Object* Find(ObjectAddress address);
  const std::map<ObjectAddress, Object>& objects() const { return objects_; }
  /// Greatest subindex; -1 when there is no such index.
  int MaxSubindex(uint16_t index) const;

  /// The master's upload and download.
  SdoAbort Read(ObjectAddress address, std::vector<uint8_t>* data) const;
  SdoAbort Write(ObjectAddress address, std::span<const uint8_t> data);
  /// Complete access: from `address.subindex`, 0 or 1, to the last; subindex 0 takes two bytes.
  SdoAbort ReadComplete(ObjectAddress address, std::vector<uint8_t>* data) const;
  SdoAbort WriteComplete(ObjectAddress address, std::span<const uint8_t> data);

 private:
  SdoAbort Missing(ObjectAddress address) const;

  std::map<ObjectAddress, Object> objects_;
};

}  // namespace poise::ethercat
