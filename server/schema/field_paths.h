// The flat paths of a scene's fields, as settings.h takes them. For command lines, which complete
// and check them without the JSON library.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace relit::server {

struct FieldPath {
    std::string path;                ///< "material.specular.k"
    std::vector<std::string> words;  ///< words that it may be: of an enumeration, "auto", "null"
    std::string sentence;            ///< what it means
};

/// Every field of a scene that holds no other, in the table's order: those of all kinds of lights
/// below "light", images by "image".
[[nodiscard]] std::vector<FieldPath> field_paths();

/// Whether a scene's JSON has a field of that path (through objects, not through lists).
/// @throws Error as parse_json()
[[nodiscard]] bool has_field(std::string_view scene_json, std::string_view path);

}  // namespace relit::server
