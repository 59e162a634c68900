// Groups of fields that a message type gets at run time: a scenario holds the configuration of any
// component, whoever wrote it.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/text_format.h>

#include <string>
#include <string_view>
#include <vector>

namespace poise {

/// From now on a message of type `to` may hold a group `name` with the fields of `group`, in text
/// and in paths as if it were its own. `to` must declare extensions from 1000 on. A name that is
/// known with the same group changes nothing. Throws ConfigError when `to` has another field of
/// that name.
void AddField(const google::protobuf::Descriptor& to, const std::string& name,
              const google::protobuf::Descriptor& group);

/// The field of that name, added ones too; nullptr: there is none.
const google::protobuf::FieldDescriptor* FindField(const google::protobuf::Descriptor& type,
                                                   std::string_view name);

/// The added fields of a type, in the order in which they came.
std::vector<const google::protobuf::FieldDescriptor*> AddedFields(
    const google::protobuf::Descriptor& type);

/// Text of a message as ParseTextProto takes it. `one_line`: without line breaks.
std::string TextOf(const google::protobuf::Message& message, bool one_line = false);

/// Prepares a text for a parser of this type: the names of added fields in the brackets that
/// protobuf's text format asks for. Lines stay lines.
std::string WithBrackets(std::string_view text, const google::protobuf::Descriptor& type);

/// Finds added fields for a TextFormat::Parser. Lives for ever.
google::protobuf::TextFormat::Finder* AddedFieldFinder();

}  // namespace poise
