// The samples that ship: small reliefs and environments that everybody may use, in the program
// itself. For first pictures, for the page, for presets that need an environment. Who made them:
// README.md beside this file.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace relit::server {

struct Sample {
    std::string_view name;    ///< "plato"
    std::string_view title;   ///< what it is, for people
    std::string_view kind;    ///< "relief" or "environment"
    std::string_view credit;  ///< who made it, and by which way it came
    std::string_view licence;
    std::string_view source;  ///< where more is said of it, an address; may be empty
    /// A scene that suits it, JSON: for a relief without its `height`, for an environment whole but
    /// for the `height`.
    std::string scene;
    std::string_view bytes;  ///< the file, for as long as the program runs
    std::string id;          ///< SHA-256 of the bytes, as of any image
};

/// All samples, reliefs first, in the order in which to offer them.
[[nodiscard]] const std::vector<Sample>& samples();

/// The sample of that id or name; null when there is none.
[[nodiscard]] const Sample* find_sample(std::string_view id_or_name);

}  // namespace relit::server
