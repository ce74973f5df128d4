// The parameters of a request's URL. Nothing is silently ignored: neither is a parameter.
#pragma once

#include <initializer_list>
#include <string_view>

#include "server/http/message.h"

namespace relit::server {

/// @throws Error unknown_field for a parameter of another name, duplicate_field for one that is
///         there twice
void allow_parameters(const Request& request, std::initializer_list<std::string_view> names);

}  // namespace relit::server
