// Names of things in a SharedCache, made of the parts that make a thing what it is. For whoever keeps
// things.
#pragma once

#include <locale>
#include <sstream>
#include <string>

namespace relit {

/// The parts in a row; two numbers that differ give two texts.
template <class... Parts>
[[nodiscard]] std::string key_of(const Parts&... parts) {
    std::ostringstream key;
    key.imbue(std::locale::classic());
    key.precision(17);
    ((key << parts << ' '), ...);
    return key.str();
}

}  // namespace relit
