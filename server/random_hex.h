// Names that nobody else gives and nobody guesses.
#pragma once

#include <spdlog/fmt/fmt.h>

#include <random>
#include <string>

namespace relit::server {

/// 8 * `words` hex digits from the system's source of randomness.
[[nodiscard]] inline std::string random_hex(int words) {
    std::random_device device;
    std::string text;
    for (int i = 0; i < words; ++i) text += fmt::format("{:08x}", device());
    return text;
}

}  // namespace relit::server
