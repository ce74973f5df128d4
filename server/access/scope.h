// What a request needs to be allowed to do, and what a key is good for.
#pragma once

#include <string_view>

namespace relit::server {

/// Each includes those before it.
enum class Scope {
    open,    ///< no key at all: health, pages, the interface's description
    read,    ///< what is stored and what was made
    render,  ///< images in, pictures out, batches
    admin    ///< what takes something away from everybody; metrics
};

[[nodiscard]] constexpr std::string_view name_of(Scope scope) {
    constexpr std::string_view names[] = {"open", "read", "render", "admin"};
    return names[int(scope)];
}

}  // namespace relit::server
