// What the API says of the media that were measured.
#pragma once

#include <string>

namespace relit::server {

/// {"media": [{"name", "title", "source", "medium": {"sigmaA", "sigmaS", "g", "eta"}, "albedo",
/// "freePath", "reach"}]}: albedo is what the standard dipole reflects of diffuse light, freePath is
/// l' and reach 1 / sigma_tr, both in mm.
[[nodiscard]] std::string media_json();

}  // namespace relit::server
