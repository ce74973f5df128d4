// Presets: scenes to start from, by name. A scene that names one is laid over it as a merge patch
// (RFC 7396). Source: integrated model, section 8; api.md, "A scene".
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace relit::server {

struct PresetInfo {
    std::string_view name;
    std::string_view sentence;  ///< what it looks like, and what it suits
};

/// All presets, in the order in which to offer them.
[[nodiscard]] std::vector<PresetInfo> preset_list();

/// {"presets": [{"name", "description", "scene"}]}
[[nodiscard]] std::string presets_json();

}  // namespace relit::server
