// A port's message as part of a component's state.
#pragma once

#include "components/framework/state_archive.h"
#include "poise/message_traits.hpp"

namespace poise {

/// Shows every field of `message`, which must have its counts: for an output, which keeps its
/// values from tick to tick.
template <class T>
void ArchiveMessage(T* message, StateArchive* archive) {
  MessageTraits<T>::VisitFields(*message, [&](const char*, auto& field) { archive->Show(field); });
}

}  // namespace poise
