#include "components/framework/ports.h"

namespace poise {

#define POISE_PORTS(T)     \
  template class Input<T>; \
  template class Output<T>;
POISE_PORT_MESSAGES(POISE_PORTS)
#undef POISE_PORTS

}  // namespace poise
