#pragma once

namespace trn {

/// A field of a message type, as its .lcm file has it.
struct MessageField {
  const char* name;
  const char*
      count;     ///< the field that says how many elements it has; empty: it is alone, or of fixed length
  bool boolean;  ///< an int8_t that means yes or no
};

/// The fields of a generated message type, made from its .lcm file at build time (lcm_types/fields.h):
/// `each(message, visit)` calls visit(MessageField, value) for each of them, in order; fields that only tell
/// the length of others are left out.
template <typename Message>
struct MessageFields;

}  // namespace trn
