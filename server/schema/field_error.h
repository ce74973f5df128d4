// Refusals of a field's value, worded so that they can be read without the pointer.
#pragma once

#include <string>
#include <string_view>

namespace relit::server {

/// "/material/specular/k" -> "'material.specular.k'", as flat parameters and command lines spell
/// it; "" -> "the scene".
[[nodiscard]] std::string field_name(std::string_view pointer);

/// @param detail  goes on after the field's name: "must be a number from 0 to 1"
/// @param limit   the setting behind it, if any
/// @throws Error invalid_value, always
[[noreturn]] void refuse_value(const std::string& detail, const std::string& pointer,
                               std::string_view limit = {});

}  // namespace relit::server
