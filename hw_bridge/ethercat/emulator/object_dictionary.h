// ObjectDictionary: the objects of an emulated CoE slave, and who may do what with them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>

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
    uint8_t size = 4;  ///< bytes, 1 to 4
    uint8_t access = kReadOnly;
    uint32_t value = 0;
    /// Asked before the master's write; refuses with other than kNone.
    std::function<SdoAbort(uint32_t value)> on_write;
  };

  /// Adds or replaces an object; the address of the result stays valid.
  Object* Add(ObjectAddress address, uint8_t size, uint8_t access, uint32_t value = 0,
              std::function<SdoAbort(uint32_t)> on_write = nullptr);
  /// nullptr when there is none.
  const Object* Find(ObjectAddress address) const;
  Object* Find(ObjectAddress address);

  /// The master's upload and download.
  SdoAbort Read(ObjectAddress address, uint32_t* value, uint8_t* size) const;
  SdoAbort Write(ObjectAddress address, uint32_t value, uint8_t size);

 private:
  SdoAbort Missing(ObjectAddress address) const;

  std::map<ObjectAddress, Object> objects_;
};

}  // namespace poise::ethercat
