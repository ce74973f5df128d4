// Bytes that several readers share without a copy: a mapped file, a finished picture in a cache.
#pragma once

#include <memory>
#include <string_view>

namespace relit::server {

/// A view and what keeps it alive. Copies share; safe to read from any thread.
struct SharedBytes {
    std::shared_ptr<const void> owner;
    std::string_view bytes;

    operator std::string_view() const {
        return bytes;
    }  // NOLINT(google-explicit-constructor): a view
};

}  // namespace relit::server
